// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select.h"

#include "kernels/threads/parallel.h"
#include "kernels/select/classify.h"
#include "kernels/select/select_body.h"

namespace gsc {

namespace {

constexpr size_t kGroupsPerTask = 16;

struct Frame {
    const SelectArgs& args;
    EyeClassifier eyes[kMaxEyes];
    EyeBand bands[kMaxEyes];
};

// Eyes among `candidates`, a bit each, that may see something of the chunk or group.
template <typename Record>
uint32_t eyesOf(const Frame& frame, const Record& record, uint32_t level_index, uint32_t candidates)
{
    const ModelView& model = *frame.args.model;
    uint32_t eyes = 0;
    for (uint32_t e = 0; e < frame.args.eye_count; ++e) {
        const EyeBounds& bounds = frame.eyes[e].bounds;
        if ((candidates >> e & 1) &&
            !rejectsBox(bounds, record.anchor_min, record.anchor_max, record.anchor_sigma_max) &&
            !rejectsLevel(*model.params, bounds, model.levels[level_index].level, record.anchor_min, record.anchor_max,
                          record.extra_level_max) &&
            mayTouch(frame.bands[e], record.gaussian_min, record.gaussian_max, record.gaussian_sigma_max))
            eyes |= 1u << e;
    }
    return eyes;
}

// Loads positions, sizes and level offsets of a group's anchors.
void loadLanes(const ModelView& model, const GroupRecord& group, uint32_t first, GroupLanes& lanes)
{
    const ChunkArrays& arrays = model.arrays[group.chunk];
    lanes.count = group.anchor_count;
    if (arrays.grid_position != nullptr) {
        const ChunkRecord& chunk = model.chunks[group.chunk];
        const float quantum = model.levels[group.level_index].quantum, origin = model.levels[group.level_index].origin;
        const GridPosition* grid = arrays.grid_position + first;
        for (uint32_t i = 0; i < lanes.count; ++i) {
            lanes.x[i] = gridCoordinate(chunk.origin[0] + int32_t(grid[i].local[0]), quantum, origin, false);
            lanes.y[i] = gridCoordinate(chunk.origin[1] + int32_t(grid[i].local[1]), quantum, origin, false);
            lanes.z[i] = gridCoordinate(chunk.origin[2] + int32_t(grid[i].local[2]), quantum, origin, false);
        }
    } else {
        const float* position = arrays.float_position + size_t(3) * first;
        for (uint32_t i = 0; i < lanes.count; ++i) {
            lanes.x[i] = position[3 * i];
            lanes.y[i] = position[3 * i + 1];
            lanes.z[i] = position[3 * i + 2];
        }
    }
    const float* scale = arrays.scale + size_t(6) * first;
    for (uint32_t i = 0; i < lanes.count; ++i) {
        const float a = scale[6 * i], b = scale[6 * i + 1], c = scale[6 * i + 2];
        const float largest = a > b ? (a > c ? a : c) : (b > c ? b : c), sum = a + b + c;
        lanes.log_sigma[i] = sum == sum ? largest : sum;
        lanes.extra_level[i] = arrays.extra_level != nullptr ? arrays.extra_level[first + i] : 0.0f;
    }
}

// Eyes that may see something of the group, a bit each; `candidates`: those that may see something of its chunk.
uint32_t testGroup(const Frame& frame, uint32_t index, uint32_t candidates, SelectCounts& counts)
{
    const GroupRecord& group = frame.args.model->groups[index];
    for (uint32_t e = 0; e < frame.args.eye_count; ++e)
        counts.groups_tested[e] += candidates >> e & 1;
    return eyesOf(frame, group, group.level_index, candidates);
}

// Tests the anchors of a group that `eyes` may see. Returns the number of anchors that at least one eye sees.
uint32_t testAnchors(const Frame& frame, uint32_t eyes, GroupMask& mask, SelectCounts& counts)
{
    const SelectArgs& args = frame.args;
    const ModelView& model = *args.model;
    const GroupRecord& group = model.groups[mask.group];
    for (auto& eye : mask.visible)
        for (uint64_t& bits : eye)
            bits = 0;
    if (eyes == 0)
        return 0;
    const uint32_t first = group.anchor_first - model.chunks[group.chunk].anchor_first;
    const LodClassifier lod =
        lodClassifier(*model.params, model.levels[group.level_index].level, args.lod_bias, args.lod_fade);
    GroupLanes lanes;
    loadLanes(model, group, first, lanes);
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        if (!(eyes >> e & 1))
            continue;
        counts.anchors_tested[e] += group.anchor_count;
        Classes classes{};
        if (frame.eyes[e].usable)
            classifyGroup(frame.eyes[e], lod, lanes, classes);
        for (uint32_t w = 0; w < kGroupSize / 64 && w * 64 < group.anchor_count; ++w) {
            const uint64_t all =
                group.anchor_count - w * 64 >= 64 ? ~uint64_t(0) : (uint64_t(1) << (group.anchor_count - w * 64)) - 1;
            uint64_t visible = classes.visible[w] & all;
            for (uint64_t open = all & ~classes.visible[w] & ~classes.hidden[w]; open != 0; open &= open - 1) {
                const uint32_t bit = uint32_t(__builtin_ctzll(open));
                if (testAnchor<float>(model, args.eyes[e], args.rules, args.lod_bias, args.lod_fade, group.chunk,
                                      first + w * 64 + bit, lod.shift)
                        .visible)
                    visible |= uint64_t(1) << bit;
            }
            for (uint64_t open = frame.bands[e].whole ? 0 : visible; open != 0; open &= open - 1) {
                const uint32_t bit = uint32_t(__builtin_ctzll(open));
                if (!anchorMayTouch(model, frame.bands[e], group.chunk, first + w * 64 + bit))
                    visible &= ~(uint64_t(1) << bit);
            }
            mask.visible[e][w] = visible;
            counts.anchors_visible[e] += uint64_t(__builtin_popcountll(visible));
        }
    }
    uint32_t either = 0;
    for (uint32_t w = 0; w < kGroupSize / 64; ++w)
        either += uint32_t(__builtin_popcountll(mask.visible[0][w] | mask.visible[1][w]));
    return either;
}

void listGroup(const Frame& frame, const GroupMask& mask, VisibleAnchor* visible)
{
    const SelectArgs& args = frame.args;
    const ModelView& model = *args.model;
    const GroupRecord& group = model.groups[mask.group];
    const uint32_t first = group.anchor_first - model.chunks[group.chunk].anchor_first;
    const bool fades = levelsFade(*model.params, args.lod_fade);
    const float shift = lodShift<float>(*model.params, model.levels[group.level_index].level);
    for (uint32_t w = 0; w < kGroupSize / 64; ++w)
        for (uint64_t bits = mask.visible[0][w] | mask.visible[1][w]; bits != 0; bits &= bits - 1) {
            const uint32_t bit = uint32_t(__builtin_ctzll(bits));
            VisibleAnchor anchor{group.chunk, first + w * 64 + bit, 0, {1, 1}};
            for (uint32_t e = 0; e < args.eye_count; ++e)
                if (mask.visible[e][w] >> bit & 1) {
                    anchor.eyes |= 1u << e;
                    if (fades)
                        anchor.fraction[e] = testLevel<float>(model, args.eyes[e].center, args.lod_bias, args.lod_fade,
                                                              anchor.chunk, anchor.local, shift)
                                                 .fraction;
                }
            *visible++ = anchor;
        }
}

// Gathers for each eye what the tests need.
Frame frameOf(const SelectArgs& args, const Workers& workers, SelectScratch& scratch)
{
    Frame frame{args, {}, {}};
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        frame.eyes[e] = eyeClassifier(*args.model->params, args.eyes[e], args.rules, args.lod_bias, args.lod_fade);
        frame.bands[e] = eyeBand(args.eyes[e], args.columns);
    }
    scratch.worker_counts.assign(size_t(workers.count()), SelectCounts{});
    return frame;
}

// Calls frameOf(), and finds for each chunk the eyes that may see it.
Frame beginFrame(const SelectArgs& args, const Workers& workers, SelectScratch& scratch)
{
    const ModelView& model = *args.model;
    const Frame frame = frameOf(args, workers, scratch);
    scratch.chunk_eyes.reserve(model.params->chunk_count);
    workers.run(model.params->chunk_count, 256, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c)
            scratch.chunk_eyes[c] = eyesOf(frame, model.chunks[c], model.chunks[c].level_index, ~0u);
    });
    return frame;
}

// Calls take(group) for every group whose chunk some eye may see.
template <typename Take>
void forCandidates(const ModelView& model, const SelectScratch& scratch, const Take& take)
{
    for (size_t c = 0; c < model.params->chunk_count; ++c)
        for (uint32_t g = 0; scratch.chunk_eyes[c] != 0 && g < model.chunks[c].group_count; ++g)
            take(model.chunks[c].group_first + g);
}

// Lists the visible anchors of scratch.groups. On entry `first` of each group is its number of visible anchors; a
// running sum replaces that.
size_t listVisible(const Frame& frame, const Workers& workers, SelectScratch& scratch, Buffer<VisibleAnchor>& visible)
{
    size_t total = 0;
    for (size_t i = 0; i < scratch.group_count; ++i) {
        const uint32_t n = scratch.groups[i].first;
        scratch.groups[i].first = uint32_t(total);
        total += n;
    }
    visible.reserve(total);
    workers.run(scratch.group_count, kGroupsPerTask, [&](size_t begin, size_t end, int) {
        for (size_t i = begin; i < end; ++i)
            listGroup(frame, scratch.groups[i], visible.data() + scratch.groups[i].first);
    });
    return total;
}

void sumCounts(const SelectScratch& scratch, SelectCounts& counts)
{
    counts = {};
    for (const SelectCounts& part : scratch.worker_counts)
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            counts.groups_tested[e] += part.groups_tested[e];
            counts.anchors_tested[e] += part.anchors_tested[e];
            counts.anchors_visible[e] += part.anchors_visible[e];
        }
}

} // namespace

size_t selectCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, Buffer<VisibleAnchor>& visible,
                 SelectCounts& counts)
{
    const ModelView& model = *args.model;
    const Frame frame = beginFrame(args, workers, scratch);
    scratch.groups.reserve(model.params->group_count);
    scratch.group_count = 0;
    forCandidates(model, scratch, [&](uint32_t group) { scratch.groups[scratch.group_count++].group = group; });
    workers.run(scratch.group_count, kGroupsPerTask, [&](size_t begin, size_t end, int worker) {
        SelectCounts& own = scratch.worker_counts[size_t(worker)];
        for (size_t i = begin; i < end; ++i) {
            GroupMask& mask = scratch.groups[i];
            const uint32_t candidates = scratch.chunk_eyes[model.groups[mask.group].chunk];
            mask.first = testAnchors(frame, testGroup(frame, mask.group, candidates, own), mask, own);
        }
    });
    const size_t total = listVisible(frame, workers, scratch, visible);
    sumCounts(scratch, counts);
    return total;
}

size_t selectGroupsCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, SelectCounts& counts)
{
    const ModelView& model = *args.model;
    const Frame frame = beginFrame(args, workers, scratch);
    scratch.seen.reserve(model.params->group_count);
    size_t candidates = 0, seen = 0;
    forCandidates(model, scratch, [&](uint32_t group) { scratch.seen[candidates++].group = group; });
    workers.run(candidates, 256, [&](size_t begin, size_t end, int worker) {
        for (size_t i = begin; i < end; ++i) {
            SeenGroup& entry = scratch.seen[i];
            entry.eyes = testGroup(frame, entry.group, scratch.chunk_eyes[model.groups[entry.group].chunk],
                                   scratch.worker_counts[size_t(worker)]);
        }
    });
    for (size_t i = 0; i < candidates; ++i)
        if (scratch.seen[i].eyes != 0)
            scratch.seen[seen++] = scratch.seen[i];
    sumCounts(scratch, counts);
    return seen;
}

size_t selectAnchorsCpu(const SelectArgs& args, const SeenGroup* groups, size_t group_count, const Workers& workers,
                        SelectScratch& scratch, Buffer<VisibleAnchor>& visible, SelectCounts& counts)
{
    const Frame frame = frameOf(args, workers, scratch);
    scratch.groups.reserve(group_count);
    scratch.group_count = group_count;
    workers.run(group_count, kGroupsPerTask, [&](size_t begin, size_t end, int worker) {
        for (size_t i = begin; i < end; ++i) {
            GroupMask& mask = scratch.groups[i];
            mask.group = groups[i].group;
            mask.first = testAnchors(frame, groups[i].eyes, mask, scratch.worker_counts[size_t(worker)]);
        }
    });
    const size_t total = listVisible(frame, workers, scratch, visible);
    sumCounts(scratch, counts);
    return total;
}

} // namespace gsc
