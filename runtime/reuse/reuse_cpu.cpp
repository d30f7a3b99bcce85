// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/reuse_cpu.h"

#include "runtime/cpu/frame/paint_cpu.h"
#include "runtime/backend/frame_checks.h"
#include "kernels/threads/stopwatch.h"
#include "kernels/sensitivity/sensitivity.h"
#include "kernels/math/lod.h"
#include "runtime/model/model_sensitivity.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gsc {

void CpuReuse::load(const ModelView& model)
{
    m_model = model;
    m_cache.load(*model.params);
    m_sensitivity.clear();
    for (auto& seen : m_seen)
        seen.clear();
    clear();
}

void CpuReuse::clear()
{
    m_cache.clear();
    m_frame = 0;
    m_policy = ReusePolicy::None;
    m_motion.forget();
    std::fill(std::begin(m_level), std::end(m_level), 0.0f);
    for (auto& seen : m_seen)
        std::fill(seen.begin(), seen.end(), Seen{});
}

uint64_t CpuReuse::bytes() const
{
    uint64_t bytes = m_cache.bytes() + m_work.capacity() * sizeof(StripWork) + m_sensitivity.capacity() * 2 +
                     (m_groups.capacity() + m_candidates.capacity()) * sizeof(uint32_t) +
                     m_budgeted.capacity() * sizeof(Candidate);
    for (const auto& seen : m_seen)
        bytes += seen.capacity() * sizeof(Seen);
    return bytes;
}

void CpuReuse::reserveStrip(DecodeState& state) const
{
    reserveDecode(m_model, state.gathered);
    const uint32_t offsets = m_model.params->n_offsets;
    state.strip_keys.reserve(kMaxEyes * stripKeyValues(offsets));
    state.strip_fixed.reserve(stripFixedValues(offsets));
    state.strip_packed.reserve(kMaxEyes * packedStripBytes(offsets));
    reservePack(offsets, state.pack);
}

uint32_t CpuReuse::stripAnchors(size_t block, uint32_t strip) const
{
    const uint32_t anchors = m_model.groups[m_groups[block]].anchor_count;
    return std::min(anchors - strip * kStripAnchors, kStripAnchors);
}

void CpuReuse::listGroups(const ReuseFrame& frame)
{
    m_groups.clear();
    m_candidates.clear();
    for (size_t i = 0; i < frame.selected.group_count; ++i) {
        const GroupMask& mask = frame.selected.groups[i];
        const size_t end =
            i + 1 < frame.selected.group_count ? frame.selected.groups[i + 1].first : frame.visible_count;
        if (end == mask.first)
            continue;
        m_groups.push_back(mask.group);
        m_candidates.push_back(uint32_t(i));
    }
}

// Call it for a frame that is drawn without reuse: entries grow older by it, and the cameras' motion is unknown
// afterwards.
void CpuReuse::skipFrame()
{
    ++m_frame;
    m_motion.forget();
}

void CpuReuse::run(const ReuseFrame& frame, FrameResult& result)
{
    Stopwatch watch;
    const ReuseOptions& reuse = frame.options.reuse;
    // entries decoded for another appearance, or scheduled by another policy, cannot be drawn in this frame
    const bool merged = decodesMerged(frame.options, frame.eye_count);
    if (frame.options.appearance != m_appearance || reuse.policy != m_policy || merged != m_merged)
        clear();
    m_merged = merged;
    m_appearance = frame.options.appearance;
    m_policy = reuse.policy;
    ++m_frame;
    m_motion.follow(frame.eyes, frame.eye_count);
    m_rule = reuseRule(reuse, m_motion.eyes());
    const uint64_t limit = reuse.cache_bytes > 0 ? reuse.cache_bytes : m_memory;
    const uint64_t evictions = m_cache.evictions();
    m_cache.shrink(limit);

    listGroups(frame);
    const size_t blocks = m_groups.size();
    if (reuse.policy == ReusePolicy::Depth) {
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            m_seen[e].resize(m_model.params->group_count);
        m_depth = reuseDepth(reuse.guidance, reuse.max_depth, updateRate(frame));
    } else if (m_model.sensitivity == nullptr && m_sensitivity.empty()) {
        m_sensitivity = modelSensitivity(m_model, m_workers);
    }
    for (DecodeState& state : frame.states)
        reserveStrip(state);
    m_work.resize(blocks * kStripsPerGroup);
    m_workers.run(blocks, 8, [&](size_t begin, size_t end, int) {
        for (size_t block = begin; block < end; ++block)
            scheduleBlock(frame, block);
    });
    grant(frame);
    // note: everything that may run out of memory is done before slots are given out, because their entries are still
    // empty
    const size_t capacity = size_t(kGroupSize) * m_model.params->n_offsets;
    for (uint32_t e = 0; e < frame.eye_count; ++e)
        frame.stores[e].reserve(blocks, blocks * capacity);
    const DecodeArgs args =
        prepareDecode(m_model, frame.eyes, frame.eye_count, nullptr, 0, frame.options.appearance, frame.bias);
    giveSlots(frame, limit);
    const double scheduled = watch.lap();

    m_workers.run(blocks, 1, [&](size_t begin, size_t end, int worker) {
        for (size_t block = begin; block < end; ++block)
            drawBlock(frame, args, block, frame.states[size_t(worker)]);
    });
    result.times.decode = scheduled;
    addShares(frame.states, watch.lap(), result.times);
    result.cache_bytes = m_cache.bytes();
    result.cache_evictions = m_cache.evictions() - evictions;
}

// Gives cache slots to strips that will be decoded. Strips that get none because the cache's limit is reached are
// drawn without being kept.
void CpuReuse::giveSlots(const ReuseFrame& frame, uint64_t limit)
{
    size_t wanted = 0;
    for (size_t w = 0; w < m_work.size(); ++w)
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            wanted += m_work[w].eye[e].decode && m_cache.find(stripId(w), e) == kNoSlot;
    size_t room = m_cache.makeRoom(wanted, limit, m_frame);
    for (size_t w = 0; w < m_work.size(); ++w)
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            EyeWork& eye = m_work[w].eye[e];
            if (!eye.decode)
                continue;
            eye.slot = m_cache.find(stripId(w), e);
            if (eye.slot == kNoSlot && room > 0) {
                eye.slot = m_cache.add(stripId(w), e);
                --room;
            }
        }
}

// Decodes a strip for the eyes whose decode was granted, into their entries, or into the worker's memory for an eye
// without an entry.
void CpuReuse::decodeStrip(const ReuseFrame& frame, const DecodeArgs& args, size_t block, uint32_t strip,
                           const StripWork& work, DecodeState& state)
{
    const GroupRecord& group = m_model.groups[m_groups[block]];
    const uint32_t first = group.anchor_first - m_model.chunks[group.chunk].anchor_first + strip * kStripAnchors;
    const uint32_t count = stripAnchors(block, strip);
    const uint32_t offsets = m_model.params->n_offsets;
    EyeParams centers[kMaxEyes];
    uint16_t* keys[kMaxEyes] = {};
    uint32_t eyes[kMaxEyes], eye_count = 0;
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        const EyeWork& eye = work.eye[e];
        if (!eye.decode)
            continue;
        keys[eye_count] = state.strip_keys.data() + eye_count * stripKeyValues(offsets);
        std::copy_n(eye.plan.center[1], 3, centers[eye_count].center);
        eyes[eye_count++] = e;
        // if eyes are merged, the first eye owns the entries even of strips that only the second sees; count these for
        // the second
        state.decoded[m_merged && eye.lanes == 0 ? 1 : e] += count;
    }
    VisibleAnchor anchors[kStripAnchors];
    for (uint32_t i = 0; i < count; ++i)
        anchors[i] = {group.chunk, first + i, 3, {1, 1}};
    DecodeArgs strip_args = args;
    strip_args.eyes = centers;
    strip_args.eye_count = eye_count;
    strip_args.visible = anchors;
    strip_args.visible_count = count;
    decodeStripCpu(strip_args, count, keys, state.strip_fixed.data(), state.scratch);
    for (uint32_t i = 0; i < eye_count; ++i) {
        const EyeWork& eye = work.eye[eyes[i]];
        StripPack pack{{keys[i], nullptr}, state.strip_fixed.data(), count, offsets};
        if (eye.slot == kNoSlot) {
            packStripCpu(pack, state.pack, state.strip_packed.data() + eyes[i] * packedStripBytes(offsets));
            continue;
        }
        CacheEntry& entry = m_cache.entry(eye.slot);
        uint16_t* last = m_cache.lastKey(eye.slot);
        if (eye.plan.count == 2) { // packs the strip between the entry's last key and the new key
            pack.keys[0] = last;
            pack.keys[1] = keys[i];
        }
        entry.extent = packStripCpu(pack, state.pack, m_cache.packed(eye.slot));
        std::memcpy(last, keys[i], stripKeyValues(offsets) * sizeof(uint16_t));
        entry.keys = eye.plan;
        entry.decoded = m_frame;
    }
}

// Appends the strip's Gaussians that eye `e` sees to the worker's block.
void CpuReuse::drawStrip(const ReuseFrame& frame, uint32_t strip, uint32_t e, const StripWork& work,
                         const float* fraction, DecodeState& state) const
{
    const EyeWork& eye = work.eye[e];
    const auto seen = uint32_t(__builtin_popcount(eye.lanes));
    const bool shared = drawsShared(work, e);
    if (!eye.decode) {
        state.reused[e] += seen;
        state.overdue[e] += eye.due || (eye.shares && !shared) ? seen : 0;
    }
    StripMix mix{};
    if (const uint32_t slot = drawnSlot(work, e); slot != kNoSlot) {
        mix.packed = m_cache.packed(slot);
        mix.t = placeBetween(m_cache.entry(slot).keys, frame.eyes[e].center).t;
    } else { // no slot: the strip was decoded in this frame, for this eye or for both
        mix.packed = state.strip_packed.data() + (shared ? 0 : e) * packedStripBytes(m_model.params->n_offsets);
    }
    mix.fraction = fraction != nullptr ? fraction + strip * kStripAnchors : nullptr;
    mix.lanes = eye.lanes;
    mix.n_offsets = m_model.params->n_offsets;
    mix.first_origin = strip * kStripAnchors * mix.n_offsets;
    GaussianBlock& out = state.gathered.blocks[e];
    mixStripCpu(mix, out);
}

// Adds to `ahead` the memory that drawing or decoding strip `at` of the frame will read or replace. Entries lie in no
// order that hardware prefetching could follow.
void CpuReuse::lookAhead(size_t at, ReadAhead& ahead) const
{
    const StripWork& work = m_work[at];
    const ModelParams& params = *m_model.params;
    if (work.eye[0].decode || work.eye[1].decode) {
        const GroupRecord& group = m_model.groups[m_groups[at / kStripsPerGroup]];
        const auto strip = uint32_t(at % kStripsPerGroup);
        const size_t first = group.anchor_first - m_model.chunks[group.chunk].anchor_first + strip * kStripAnchors;
        const size_t count = stripAnchors(at / kStripsPerGroup, strip);
        const ChunkArrays& arrays = m_model.arrays[group.chunk];
        ahead.add(arrays.feature + first * params.feat_dim, count * params.feat_dim * sizeof(float));
        ahead.add(arrays.offset + first * 3 * params.n_offsets, count * 3 * params.n_offsets * sizeof(float));
        ahead.add(arrays.scale + first * 6, count * 6 * sizeof(float));
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const EyeWork& eye = work.eye[e];
        if (eye.lanes == 0 || eye.slot == kNoSlot || (e == 1 && eye.slot == work.eye[0].slot))
            continue;
        // note: not the entry's own extent, which the worker that decodes the strip may be writing now
        const bool two = eye.decode || eye.drawn.t != 0;
        ahead.add(m_cache.packed(eye.slot), two ? eye.extent.two : eye.extent.one);
        if (eye.decode)
            ahead.add(m_cache.lastKey(eye.slot), stripKeyValues(params.n_offsets) * sizeof(uint16_t));
    }
}

void CpuReuse::drawBlock(const ReuseFrame& frame, const DecodeArgs& args, size_t block, DecodeState& state)
{
    Stopwatch watch;
    const GroupMask& mask = frame.selected.groups[m_candidates[block]];
    const bool fades = levelsFade(*m_model.params, frame.options.lod_fade);
    float fraction[kMaxEyes][kGroupSize];
    if (fades)
        groupFractions(frame, mask, fraction);
    for (GaussianBlock& drawn : state.gathered.blocks) {
        drawn.count = 0;
        drawn.any_positive = false;
    }
    for (uint32_t s = 0; s < kStripsPerGroup; ++s) {
        const StripWork& work = m_work[block * kStripsPerGroup + s];
        if (work.eye[0].decode || work.eye[1].decode)
            decodeStrip(frame, args, block, s, work, state);
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            if (work.eye[e].lanes != 0)
                drawStrip(frame, s, e, work, fades ? fraction[e] : nullptr, state);
        // resets the cover of entries, which is set again once their Gaussians are projected
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            if (const uint32_t slot = work.eye[e].lanes != 0 ? drawnSlot(work, e) : kNoSlot; slot != kNoSlot)
                m_cache.entry(slot).cover = 0;
    }
    state.decode_ms += watch.lap();
    // note: this worker is likely to take the next block next
    ReadAhead ahead;
    for (size_t w = (block + 1) * kStripsPerGroup; w < std::min((block + 2) * kStripsPerGroup, m_work.size()); ++w)
        lookAhead(w, ahead);
    const size_t first = block * kGroupSize * m_model.params->n_offsets;
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        SplatStore& store = frame.stores[e];
        const uint32_t splats =
            projectInto(store, block, first, {frame.eyes + e, frame.rules, &ahead, frame.options.columns},
                        state.gathered.blocks[e], e, state);
        if (m_policy == ReusePolicy::Error)
            noteCover(frame, block, e, store.splats.data() + first, store.origins.data() + first, splats);
        if (paintsGaussians(frame.options.view))
            paintBlock(frame, block, e, store.splats.data() + first, store.origins.data() + first, splats);
    }
    state.project_ms += watch.lap();
}

// Paints a block's splats in false colours. Call it after decoding: strips decoded in this frame have age 0.
void CpuReuse::paintBlock(const ReuseFrame& frame, size_t block, uint32_t e, Splat* splats, const uint16_t* origins,
                          uint32_t count) const
{
    FalseColour colours[kStripsPerGroup];
    for (uint32_t s = 0; s < kStripsPerGroup; ++s) {
        if (frame.options.view == FrameView::Level) {
            colours[s] = chunkColour(m_model, m_model.groups[m_groups[block]].chunk);
            continue;
        }
        if (frame.options.view == FrameView::Detail) { // reuse has no coarse copies, so all groups get one colour
            colours[s] = detailColour(GroupSource::Near);
            continue;
        }
        const StripWork& work = m_work[block * kStripsPerGroup + s];
        const uint32_t slot = work.eye[e].lanes != 0 ? drawnSlot(work, e) : kNoSlot;
        // a strip without an entry was decoded in this frame
        const uint64_t frames = slot != kNoSlot ? m_frame - m_cache.entry(slot).decoded : 0;
        colours[s] = ageColour(uint32_t(std::min<uint64_t>(frames, UINT32_MAX)));
    }
    paintSplats(splats, origins, count, m_model.params->n_offsets,
                [&](uint32_t anchor) { return colours[anchor / kStripAnchors]; });
}

// Notes for the next frame the largest share of eye `e`'s picture that a Gaussian of each strip of a block covers.
void CpuReuse::noteCover(const ReuseFrame& frame, size_t block, uint32_t e, const Splat* splats,
                         const uint16_t* origins, uint32_t count)
{
    const uint32_t pixels = frame.eyes[e].width * frame.eyes[e].height;
    const auto least = uint32_t(kBroad / kThinnest * float(pixels));
    for (uint32_t i = 0; i < count; ++i) {
        const Splat& splat = splats[i];
        const uint32_t area = uint32_t(splat.x1 - splat.x0 + 1) * uint32_t(splat.y1 - splat.y0 + 1);
        if (area <= least)
            continue;
        const float cover = float(area) / float(pixels) * thinness(splat.conic, float(kThinAxis));
        if (cover <= kBroad)
            continue;
        const uint32_t strip = origins[i] / (kStripAnchors * m_model.params->n_offsets);
        const uint32_t slot = drawnSlot(m_work[block * kStripsPerGroup + strip], e);
        if (slot != kNoSlot)
            m_cache.entry(slot).cover = std::max(m_cache.entry(slot).cover, cover);
    }
}

// Copies the fading factors of a group's anchors from the list of visible anchors, for levels that fade.
void CpuReuse::groupFractions(const ReuseFrame& frame, const GroupMask& mask, float (*fraction)[kGroupSize]) const
{
    const VisibleAnchor* visible = frame.visible + mask.first;
    for (uint32_t w = 0; w < kGroupSize / 64; ++w)
        for (uint64_t bits = mask.visible[0][w] | mask.visible[1][w]; bits != 0; bits &= bits - 1, ++visible)
            for (uint32_t e = 0; e < frame.eye_count; ++e)
                fraction[e][w * 64 + uint32_t(__builtin_ctzll(bits))] = visible->fraction[e];
}

} // namespace gsc
