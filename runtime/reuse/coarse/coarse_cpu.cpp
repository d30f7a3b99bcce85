// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/coarse/coarse_cpu.h"

#include "kernels/math/anchor.h"
#include "kernels/math/lod.h"
#include "kernels/threads/stopwatch.h"
#include "runtime/cpu/frame/paint_cpu.h"

#include <algorithm>

namespace gsc {

namespace {

size_t tileFloats(uint32_t gaussians)
{
    return (gaussians + kMaxLanes - 1) / kMaxLanes * kTileValues;
}

} // namespace

void CpuCoarse::load(const ModelView& model)
{
    m_model = model;
    m_kept.clear();
    m_tiles.clear();
    m_tile_bytes = 0;
    m_drawn.clear();
}

void CpuCoarse::clear()
{
    load(m_model);
}

const std::vector<SeenGroup>& CpuCoarse::choose(const CpuCoarseFrame& frame, FrameResult& result)
{
    const FrameOptions& options = frame.options;
    Stopwatch watch;
    if (options.appearance != m_appearance || options.lod_fade != m_fade)
        clear();
    m_appearance = options.appearance;
    m_fade = options.lod_fade;
    ++m_frame;
    m_kept.resize(m_model.params->group_count);
    m_tiles.resize(m_model.params->group_count);
    m_looks.resize(frame.seen_count);
    m_scratch.resize(frame.states.size());
    for (JoinScratch& scratch : m_scratch)
        reserveJoin(m_model.params->n_offsets, scratch);
    const RasterConstants rules = rasterConstants(*m_model.params, options.near_z);
    const CoarseView view = coarseView(frame.eyes, frame.level_eyes, frame.eye_count, options.detail, options.lod_bias,
                                       levelsSwitch(*m_model.params));
    frame.workers.run(frame.seen_count, 256, [&](size_t begin, size_t end, int) {
        for (size_t i = begin; i < end; ++i) {
            const SeenGroup& seen = frame.seen[i];
            const GroupRecord& record = m_model.groups[seen.group];
            bool shows_all = true;
            for (uint32_t e = 0; e < frame.eye_count; ++e)
                shows_all = shows_all && ((seen.eyes >> e & 1) == 0 || seesAll(frame.eyes[e], rules.near_z, record));
            m_looks[i] = coarseLook(view, record, m_kept[seen.group], shows_all);
        }
    });
    chooseDue(frame, result);
    result.times.select += watch.lap();

    EyeParams middle{};
    std::copy_n(view.center, 3, middle.center);
    const DecodeArgs args = prepareDecode(m_model, &middle, 1, nullptr, 0, options.appearance, frame.bias);
    frame.workers.run(m_due.size(), 1, [&](size_t begin, size_t end, int worker) {
        for (size_t i = begin; i < end; ++i)
            makeGroup(args, view, options, frame.seen[m_due[i]].group, m_looks[m_due[i]].cell,
                      frame.states[size_t(worker)], m_scratch[size_t(worker)]);
    });
    m_tile_bytes = 0;
    for (const Buffer<float>& tiles : m_tiles)
        m_tile_bytes += tiles.bytes();
    list(frame, result);
    result.times.decode += watch.lap();
    result.cache_bytes = m_tile_bytes;
    return m_near;
}

// Chooses which due copies are made, as far as there is memory: first those of groups without a usable copy, then
// those with the largest change.
void CpuCoarse::chooseDue(const CpuCoarseFrame& frame, FrameResult& result)
{
    m_due.clear();
    for (size_t i = 0; i < frame.seen_count; ++i) {
        if (m_looks[i].due)
            m_due.push_back(uint32_t(i));
        // marks the copy of a group that an eye sees as used, so that it is not dropped
        m_kept[frame.seen[i].group].used = m_frame;
    }
    const uint64_t asked = frame.options.reuse.cache_bytes, limit = asked > 0 ? asked : m_memory;
    // largest size of a copy, bytes
    const uint64_t most = tileFloats(kGroupSize * m_model.params->n_offsets) * sizeof(float);
    const uint64_t wanted = std::min(m_due.size() * most, limit);
    if (m_tile_bytes + wanted > limit)
        evict(m_tile_bytes + wanted - limit, result);
    const size_t room = size_t((limit - std::min(limit, m_tile_bytes)) / most);
    if (room >= m_due.size())
        return;
    std::stable_sort(m_due.begin(), m_due.end(),
                     [this](uint32_t a, uint32_t b) { return m_looks[a].change > m_looks[b].change; });
    m_due.resize(room);
    std::sort(m_due.begin(), m_due.end()); // made in file order, because neighbours lie side by side in memory
}

// Frees `wanted` bytes or more: of copies that no eye sees in this frame, those drawn least recently.
void CpuCoarse::evict(uint64_t wanted, FrameResult& result)
{
    std::vector<uint32_t> groups;
    for (uint32_t g = 0; g < m_kept.size(); ++g)
        if (m_tiles[g].bytes() > 0 && m_kept[g].used != m_frame)
            groups.push_back(g);
    std::stable_sort(groups.begin(), groups.end(),
                     [this](uint32_t a, uint32_t b) { return m_kept[a].used < m_kept[b].used; });
    for (uint64_t given = 0; const uint32_t g : groups) {
        if (given >= wanted)
            break;
        given += m_tiles[g].bytes();
        m_tile_bytes -= m_tiles[g].bytes();
        m_tiles[g] = {};
        m_kept[g] = {};
        ++result.cache_evictions;
    }
}

void CpuCoarse::makeGroup(const DecodeArgs& args, const CoarseView& view, const FrameOptions& options, uint32_t index,
                          const CoarseCell& cell, DecodeState& state, JoinScratch& scratch)
{
    const GroupRecord& record = m_model.groups[index];
    const uint32_t first = record.anchor_first - m_model.chunks[record.chunk].anchor_first;
    const int32_t level = m_model.levels[record.level_index].level;
    const auto shift = lodShift<float>(*m_model.params, level);
    VisibleAnchor anchors[kGroupSize];
    uint32_t count = 0;
    for (uint32_t i = 0; i < record.anchor_count; ++i) {
        VisibleAnchor& anchor = anchors[count];
        anchor = {record.chunk, first + i, 1, {1, 1}};
        count += levelShows<float>(*m_model.params, level, anchorPosition(m_model, record.chunk, first + i), shift,
                                   anchorExtraLevel(m_model, record.chunk, first + i), view.level_center,
                                   options.lod_bias, options.lod_fade, anchor.fraction[0]);
    }
    DecodeArgs own = args;
    own.visible = anchors;
    own.visible_count = count;
    decodeBlockCpu(own, 0, count, state.scratch);
    const GaussianBlock& decoded = state.scratch.blocks[0];
    bool far = false;
    const JoinOrigins origins{anchors, m_model.arrays[record.chunk].source_index, m_model.params->n_offsets};
    const uint32_t gaussians = joinGroupCpu(view, record, cell.edge, decoded, origins, scratch, far);
    const size_t floats = tileFloats(gaussians);
    Buffer<float>& tiles = m_tiles[index];
    if (tiles.capacity() != floats)
        tiles = {};
    m_kept[index] = {}; // the state stays empty unless there is memory for the copy
    tiles.reserveExactly(floats);
    storeCopy(scratch, gaussians, tiles.data());
    m_kept[index] = {keyOf(view, cell),
                     far ? CoarseKind::Far : CoarseKind::Near,
                     decoded.any_positive,
                     gaussians,
                     count,
                     decoded.count,
                     m_frame,
                     m_frame};
}

void CpuCoarse::list(const CpuCoarseFrame& frame, FrameResult& result)
{
    m_near.clear();
    m_drawn.clear();
    std::fill(std::begin(m_anchors), std::end(m_anchors), 0);
    for (size_t i = 0; i < frame.seen_count; ++i) {
        const SeenGroup& seen = frame.seen[i];
        const KeptGroup& kept = m_kept[seen.group];
        const bool made = kept.made == m_frame && kept.kind == CoarseKind::Far;
        if (!made && (kept.kind != CoarseKind::Far || !m_looks[i].draws)) {
            m_near.push_back(seen);
            ++result.coarse.near;
            continue;
        }
        const GroupSource source = made                    ? GroupSource::Made
                                   : m_looks[i].change > 1 ? GroupSource::Stale
                                                           : GroupSource::Kept;
        m_anchors[uint32_t(source)] += kept.anchors;
        (made ? result.coarse.made : source == GroupSource::Stale ? result.coarse.stale : result.coarse.kept) += 1;
        m_drawn.push_back({seen.group, seen.eyes, source});
    }
}

void CpuCoarse::addAnchors(uint32_t eye_count, FrameResult& result) const
{
    const auto of = [this](GroupSource source) { return m_anchors[uint32_t(source)]; };
    const uint64_t stale = of(GroupSource::Stale), reused = of(GroupSource::Kept) + stale, made = of(GroupSource::Made);
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_visible += reused + made;
        result.eyes[e].anchors_reused += reused;
        result.eyes[e].anchors_overdue += stale;
    }
    result.eyes[0].anchors_decoded += made;
}

FalseColour CpuCoarse::colourOf(const FrameOptions& options, const Drawn& drawn) const
{
    if (options.view == FrameView::Detail)
        return detailColour(drawn.source);
    if (options.view == FrameView::Level)
        return chunkColour(m_model, m_model.groups[drawn.group].chunk);
    return ageColour(uint32_t(std::min<uint64_t>(m_frame - m_kept[drawn.group].made, UINT32_MAX)));
}

void CpuCoarse::drawGroup(SplatStore& store, size_t block, size_t capacity, const ProjectArgs& args,
                          const FrameOptions& options, const Drawn& drawn, uint32_t e, DecodeState& state) const
{
    store.counts[block] = 0;
    if ((drawn.eyes >> e & 1) == 0)
        return;
    const KeptGroup& kept = m_kept[drawn.group];
    Splat* const splats = store.splats.data() + block * capacity;
    const ProjectCounts counts = projectTilesCpu(args, {m_tiles[drawn.group].data(), kept.count}, splats,
                                                 store.depth_bits.data() + block * capacity);
    store.counts[block] = counts.splats;
    state.alive[e] += kept.count;
    state.visible[e] += counts.splats;
    state.dropped[e] += counts.dropped;
    state.any_positive[e] |= kept.any_positive;
    if (paintsGaussians(options.view))
        paintSplats(splats, counts.splats, colourOf(options, drawn));
}

void CpuCoarse::draw(const CpuCoarseFrame& frame, SplatStore* stores, size_t first_block, size_t capacity,
                     FrameResult& result) const
{
    Stopwatch watch;
    const FrameOptions& options = frame.options;
    const RasterConstants rules = rasterConstants(*m_model.params, options.near_z);
    frame.workers.run(m_drawn.size(), 1, [&](size_t begin, size_t end, int worker) {
        for (size_t i = begin; i < end; ++i)
            for (uint32_t e = 0; e < frame.eye_count; ++e)
                drawGroup(stores[e], first_block + i, capacity, {frame.eyes + e, rules, nullptr, options.columns},
                          options, m_drawn[i], e, frame.states[size_t(worker)]);
    });
    addAnchors(frame.eye_count, result);
    result.times.project += watch.lap();
}

} // namespace gsc
