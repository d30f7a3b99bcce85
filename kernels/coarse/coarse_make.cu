// SPDX-License-Identifier: Apache-2.0
// Makes coarse copies: decodes a group from between the eyes and joins its small Gaussians. A block takes a group at a
// time, a warp 16 of the group's anchors that are shown.
#include "kernels/coarse/coarse_cells.cuh"
#include "kernels/coarse/coarse_list.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/emit.cuh"
#include "kernels/math/lod.h"

namespace gsc {

namespace {

constexpr uint32_t kWarps = 4, kThreads = 32 * kWarps;
constexpr uint32_t kBlocks = 2;                         // blocks that run on a multiprocessor at once
constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians of 16 anchors that are staged at a time, at most
constexpr uint32_t kMostGaussians = kMostPages * kPageGaussians;

struct MakeShared {
    DecodeNetworks networks;
    struct Staging {
        float outputs[10][kStaged], opacities[kStaged];
        uint16_t owners[kStaged]; // row | k << 8 of each staged Gaussian: row of its anchor, number of its slot
    } staging[kWarps];
    CellSums cells;
    uint32_t pages[kMostPages];
    uint32_t shows[kWarps];    // a bit for each lane: set if the anchor of that thread is shown
    uint8_t shown[kGroupSize]; // anchors that are shown, counted from the group's first anchor
    // numbers of the group's Gaussians: alive: all; small: those joined; gaussians: the others, which the copy keeps
    uint32_t alive, small, gaussians;
};
static_assert(kThreads == kGroupSize);
static_assert(sizeof(MakeShared) <= 99 * 1024); // a block can have no more on compute capability 8.6, 8.9 and 12.0

// Returns true if an anchor of the group is shown at this distance. Sets fraction to its opacity factor, as
// levelShows() does.
__device__ __forceinline__ bool showsAnchor(const CoarseCudaArgs& args, uint32_t level_index, const float4& placement,
                                            float& fraction)
{
    const DeviceModel& model = args.model;
    return levelShows<float>(model.params, model.levels[level_index].level, {placement.x, placement.y, placement.z},
                             model.lod_shift[level_index], placement.w, args.view.level_center, args.lod_bias,
                             args.lod_fade, fraction);
}

// Each thread finds out whether its anchor of the group is shown.
__device__ __forceinline__ void lookForShown(const CoarseCudaArgs& args, MakeShared& shared, const GroupRecord& record)
{
    bool shows = false;
    if (threadIdx.x < record.anchor_count) {
        const auto* const placement = reinterpret_cast<const float4*>(args.model.placement);
        float fraction;
        shows = showsAnchor(args, record.level_index, placement[record.anchor_first + threadIdx.x], fraction);
    }
    const uint32_t warp_shows = __ballot_sync(~0u, shows);
    if ((threadIdx.x & 31u) == 0)
        shared.shows[threadIdx.x >> 5] = warp_shows;
}

// Lists the anchors that are shown, after all threads have called lookForShown(), and returns their number.
__device__ __forceinline__ uint32_t listShown(MakeShared& shared)
{
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    uint32_t count = 0, at = 0;
#pragma unroll
    for (uint32_t w = 0; w < kWarps; ++w) {
        at = w == warp ? count : at;
        count += __popc(shared.shows[w]);
    }
    const uint32_t shows = shared.shows[warp];
    if ((shows >> lane & 1u) != 0)
        shared.shown[at + __popc(shows & ((1u << lane) - 1u))] = uint8_t(threadIdx.x);
    return count;
}

// Decodes the anchors of a strip, at most 16, and joins their Gaussians. first: number of the group's first anchor; shown:
// the strip's anchors, counted from it, `count` of them.
template <bool kCompact, bool kBank>
__device__ __forceinline__ void makeStrip(const CoarseCudaArgs& args, MakeShared& shared, const MadeGroup& group,
                                          uint32_t level_index, uint32_t first, const uint8_t* shown, uint32_t count,
                                          uint32_t lane, bool& positive)
{
    const DeviceModel& model = args.model;
    const uint32_t K = model.params.n_offsets, t = lane & 3u, g = lane >> 2;
    MakeShared::Staging& staged = shared.staging[threadIdx.x >> 5];
    uint32_t anchors[2];
    float positions[2][3], fractions[2];
    bool exists[2];
#pragma unroll
    for (uint32_t r = 0; r < 2; ++r) {
        const uint32_t row = g + 8 * r;
        anchors[r] = first + shown[min(row, count - 1)];
        const float4 p = reinterpret_cast<const float4*>(model.placement)[anchors[r]];
        positions[r][0] = p.x;
        positions[r][1] = p.y;
        positions[r][2] = p.z;
        exists[r] = showsAnchor(args, level_index, p, fractions[r]) && row < count;
    }
    uint32_t feature[2][4];
    float levels[2];
    gatherInputs<kCompact>(args, anchors, t, feature, levels);
    uint32_t hidden[6][4];
    const float* const center = args.view.center;
    firstLayer<kBank>(args, shared.networks, lane, positions, {center, center}, feature, levels, hidden);
    constexpr uint32_t kItems = 2 * kItemsPerLane;
    uint32_t keep = 0, at[kItems], alive;
    {
        float opacity[kOpacityTiles][4];
        opacityLayer(shared.networks, lane, hidden, opacity);
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                const float o = value(opacity, item, r) * fractions[r];
                const bool there = exists[r] && t + 4 * item < K;
                positive |= there && o > 0.0f;
                keep |= there && o >= kOpacityFloor ? 1u << (kItemsPerLane * r + item) : 0u;
            }
        alive = stagingIndices(keep, lane, at);
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t item = 0; item < kItemsPerLane; ++item)
                if ((keep >> (kItemsPerLane * r + item) & 1u) != 0) {
                    const uint32_t to = at[kItemsPerLane * r + item];
                    staged.opacities[to] = value(opacity, item, r) * fractions[r];
                    staged.owners[to] = uint16_t((g + 8 * r) | (t + 4 * item) << 8);
                }
    }
    if (alive == 0)
        return;
    shapeLayers(shared.networks, lane, hidden, [&](uint32_t r, uint32_t item, uint32_t which, float output) {
        if ((keep >> (kItemsPerLane * r + item) & 1u) != 0)
            staged.outputs[which][at[kItemsPerLane * r + item]] = output;
    });
    __syncwarp();
    uint32_t all = 0, small = 0;
#pragma unroll 1
    for (uint32_t i = lane; i < alive; i += 32) {
        const uint32_t owner = staged.owners[i];
        const PlainGaussian plain = plainGaussian<kCompact>(model, first + shown[owner & 255u], owner >> 8);
        const ActiveGaussian active = activeGaussian(plain, [&](uint32_t which) { return staged.outputs[which][i]; });
        const Seen it = seen(args.view, plain.position, active);
        if (plain.masked || plain.order == kNoOrder ||
            !isfinite(it.trace + it.scale + active.color[0] + active.color[1] + active.color[2]))
            continue;
        ++all;
        if (fmaxf(active.sigma[0], fmaxf(active.sigma[1], active.sigma[2])) < group.frame.cell) {
            ++small;
            join(shared.cells, group, plain.position, it, active, staged.opacities[i], plain.order);
            continue;
        }
        const uint32_t to = atomicAdd(&shared.gaussians, 1u);
        if (to >= kMostGaussians)
            continue;
        CoarseGaussian large;
#pragma unroll
        for (int j = 0; j < 3; ++j) {
            large.position[j] = plain.position[j];
            large.color[j] = active.color[j];
        }
        large.opacity = staged.opacities[i];
        large.order = plain.order;
        float rotation[9];
        rotationOf(active.quaternion, rotation);
        factorOf(rotation, active.sigma, large.factor);
        storeCoarse(args.tables.pages[shared.pages[to / kPageGaussians]], to % kPageGaussians, group.frame, large);
    }
    __syncwarp(); // waits before the staging memory is written again
    addOfWarp(&shared.alive, all, lane);
    addOfWarp(&shared.small, small, lane);
}

// Takes from the ring as many pages as a copy may need. Called by one warp.
__device__ __forceinline__ void takePages(const CoarseTables& tables, uint32_t (&pages)[kMostPages], uint32_t lane)
{
    unsigned long long from = 0;
    if (lane == 0)
        from = atomicAdd(&tables.free->taken, static_cast<unsigned long long>(kMostPages));
    from = __shfl_sync(~0u, from, 0);
    if (lane < kMostPages)
        pages[lane] = tables.ring[ringPlace(tables, from, lane)];
}

// Gives the `old` pages of a group's former copy to the ring, and all taken pages but the first `kept`. By one warp.
__device__ __forceinline__ void keepPages(const CoarseTables& tables, uint32_t group, uint32_t old,
                                          const uint32_t (&pages)[kMostPages], uint32_t kept, uint32_t lane)
{
    unsigned long long to = 0;
    if (lane == 0)
        to = atomicAdd(&tables.free->given, static_cast<unsigned long long>(old + kMostPages - kept));
    to = __shfl_sync(~0u, to, 0);
    uint32_t& own = tables.page_of[size_t(group) * kMostPages + min(lane, kMostPages - 1)];
    if (lane < old)
        tables.ring[ringPlace(tables, to, lane)] = own;
    if (lane < kept)
        own = pages[lane];
    else if (lane < kMostPages)
        tables.ring[ringPlace(tables, to, old + lane - kept)] = pages[lane];
}
static_assert(kMostPages <= 32);

// kCompact: the model is compact. kBank: the model has a feature bank, so that features depend on the viewpoint.
template <bool kCompact, bool kBank>
__global__ void __launch_bounds__(kThreads, kBlocks) makeKernel(const __grid_constant__ CoarseCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    MakeShared& shared = *reinterpret_cast<MakeShared*>(memory);
    const CoarseTables& tables = args.tables;
    CoarseCounters& counters = args.counters->coarse;
    const uint32_t count = counters.wants;
    if (blockIdx.x >= count)
        return;
    loadNetworks<kBank>(args, shared.networks);
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    bool positive = false;
    for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
        const uint32_t entry = tables.wants[i], index = entry & ((1u << kAnchorBits) - 1);
        const GroupRecord& record = args.model.groups[index];
        const CoarseCell cell = wantedCell(args.view, record.gaussian_min, record.gaussian_max);
        MadeGroup group;
        group.frame = coarseFrame(record, cell);
        group.per_cell = __fdividef(1.0f, group.frame.cell);
        bool fits = true;
        for (int a = 0; a < 3; ++a) {
            group.base[a] = floorf(record.gaussian_min[a] * group.per_cell);
            fits &= record.gaussian_max[a] * group.per_cell - group.base[a] < float(kAxisCells - 1);
        }
        const float detail = __fdividef(args.view.cell_at_one, args.view.pixel_at_one) *
                             cellGrowth(args.view, record.gaussian_min, record.gaussian_max);
        group.most = __fdividef(1.0f, 4.7f * (detail * detail + 0.3f));
        for (uint32_t c = threadIdx.x; c < kCells; c += kThreads) {
            shared.cells.keys[c] = kNoKey;
            shared.cells.orders[c] = ~0u;
#pragma unroll
            for (uint32_t s = 0; s < kSums; ++s)
                shared.cells.sums[s][c] = 0;
        }
        if (threadIdx.x == 0)
            shared.alive = shared.small = shared.cells.count = shared.gaussians = 0;
        if (warp == 0)
            takePages(tables, shared.pages, lane);
        lookForShown(args, shared, record);
        __syncthreads();
        const uint32_t anchors = listShown(shared);
        __syncthreads();
        if (fits)
#pragma unroll 1
            for (uint32_t strip = warp; 16 * strip < anchors; strip += kWarps)
                makeStrip<kCompact, kBank>(args, shared, group, record.level_index, record.anchor_first,
                                           shared.shown + 16 * strip, min(anchors - 16 * strip, 16u), lane, positive);
        __syncthreads();
        const uint32_t large = shared.gaussians, cells = shared.cells.count;
        const bool far = fits && float(shared.small) >= kFarShare * float(shared.alive) && cells <= kMostCells &&
                         large + cells <= kMostGaussians;
        if (far)
            for (uint32_t c = threadIdx.x; c < cells; c += kThreads) {
                const uint32_t to = large + c;
                storeCoarse(tables.pages[shared.pages[to / kPageGaussians]], to % kPageGaussians, group.frame,
                            joined(shared.cells, group, args.view, shared.cells.places[c]));
            }
        const uint32_t total = far ? large + cells : 0u;
        CoarseGroup& kept = tables.groups[index];
        if (warp == 0)
            keepPages(tables, index, pagesOf(kept), shared.pages, (total + kPageGaussians - 1) / kPageGaussians, lane);
        __syncthreads();
        if (threadIdx.x == 0) {
            kept = {keyOf(args.view, cell),
                    uint32_t(far ? CoarseKind::Far : CoarseKind::Near),
                    total,
                    anchors,
                    shared.alive,
                    args.frame,
                    args.frame};
            if (far) {
                tables.drawn[atomicAdd(&counters.drawn, 1u)] = entry;
                addCoarseDepth(args, args.histogram, args.model, index, entry >> kAnchorBits, total);
                atomicAdd(&counters.groups_made, 1u);
                atomicAdd(&counters.anchors_made, anchors);
            } else {
                tables.near[atomicAdd(&counters.near, 1u)] = entry;
                atomicAdd(&counters.groups_near, 1u);
            }
        }
        __syncthreads(); // waits before the shared memory is written again
    }
    if (__any_sync(~0u, positive) && lane < args.eye_count)
        atomicOr(&args.counters->any_positive[lane], 1u);
}

auto makeKernelOf(bool compact, bool bank)
{
    if (compact)
        return bank ? makeKernel<true, true> : makeKernel<true, false>;
    return bank ? makeKernel<false, true> : makeKernel<false, false>;
}

} // namespace

void loadCoarseMake(bool compact, bool bank)
{
    loadKernel(makeKernelOf(compact, bank));
}

void coarseMakeCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const auto kernel = makeKernelOf(args.model.compact_shape != nullptr, args.bank != nullptr);
    launchCuda(kernel, processors * kBlocks, kThreads, sizeof(MakeShared), stream, args);
}

} // namespace gsc
