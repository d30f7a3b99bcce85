// SPDX-License-Identifier: Apache-2.0
// Decodes a group from between the eyes and joins what is small of it: a block takes a group at a time, a warp 16 of its
// anchors. Sums of a cell are whole numbers, which do not depend on who adds first.
#include "kernels/coarse/coarse_gaussian.cuh"
#include "kernels/coarse/coarse_list.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/emit.cuh"
#include "kernels/math/lod.h"

namespace gsc {

namespace {

constexpr uint32_t kWarps = 4, kThreads = 32 * kWarps;
constexpr uint32_t kBlocks = 2;                         // per multiprocessor
constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians of 16 anchors
constexpr uint32_t kCells = 704;                        // places of cells: 99 KiB in all
constexpr uint32_t kMostCells = 640;                    // of a copy
constexpr uint32_t kMostGaussians = kMostPages * kPageGaussians;
constexpr uint32_t kAxisBits = 10, kAxisCells = 1u << kAxisBits; // cells of a group along an axis
constexpr uint32_t kNoKey = ~0u;
constexpr float kOne = float(1u << 21); // the largest weight there is: sums of up to 800 times that fit 31 bits

// Sums of a cell, in steps of 1 / kOne: weight; weight times place in the cell (3), colour (3), second moments of the
// place (6: xx xy xz yy yz zz).
enum Sum : uint32_t { kWeight = 0, kPlace = 1, kColor = 4, kMoment = 7, kSums = 13 };

struct MakeShared {
    DecodeNetworks networks;
    struct Staging {
        float outputs[10][kStaged], opacities[kStaged];
        uint16_t owners[kStaged]; // row | k << 8
    } staging[kWarps];
    uint32_t keys[kCells], orders[kCells];
    int32_t sums[kSums][kCells];
    uint32_t pages[kMostPages];
    uint32_t alive, small, cells, gaussians, anchors; // of the group
};
static_assert(sizeof(MakeShared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0

// A group as its warps need it.
struct MadeGroup {
    CoarseFrame frame;
    float base[3];  // first cell of its box
    float per_cell; // cells in a world unit
    float most;     // reciprocal of the largest weight
};

// Place of a cell, which is its own from now on; kCells: there is none left.
__device__ __forceinline__ uint32_t placeOfCell(MakeShared& shared, uint32_t key)
{
    uint32_t at = __umulhi(key * 2654435769u, kCells);
    for (uint32_t tries = 0; tries < kCells; ++tries) {
        const uint32_t was = atomicCAS(&shared.keys[at], kNoKey, key);
        if (was == kNoKey)
            atomicAdd(&shared.cells, 1u);
        if (was == kNoKey || was == key)
            return at;
        at = at + 1 == kCells ? 0 : at + 1;
    }
    return kCells;
}

// A Gaussian and how it looks from where the copy is made.
struct Seen {
    float covariance[6];          // xx xy xz yy yz zz
    float trace, along, adjugate; // screenArea()
    float scale;
};

__device__ __forceinline__ float distanceTo(const float* position, const float* center, float (&direction)[3])
{
    float square = 0.0f;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        direction[i] = position[i] - center[i];
        square = fmaf(direction[i], direction[i], square);
    }
    const float inverse = rsqrtf(fmaxf(square, 1e-30f));
#pragma unroll
    for (float& d : direction)
        d *= inverse;
    return square * inverse;
}

__device__ __forceinline__ Seen seen(const CoarseView& view, const float* position, const ActiveGaussian& active)
{
    Seen it{};
    float r[9], direction[3];
    rotationOf(active.quaternion, r);
    it.scale = __fdividef(1.0f, view.pixel_at_one * distanceTo(position, view.center, direction));
    float square[3];
#pragma unroll
    for (int k = 0; k < 3; ++k) {
        square[k] = active.sigma[k] * active.sigma[k];
        it.trace += square[k];
    }
#pragma unroll
    for (int k = 0; k < 3; ++k) {
        const float x = r[k], y = r[3 + k], z = r[6 + k];
        const float turned = x * direction[0] + y * direction[1] + z * direction[2];
        it.along = fmaf(square[k], turned * turned, it.along);
        it.adjugate = fmaf(square[(k + 1) % 3] * square[(k + 2) % 3], turned * turned, it.adjugate);
        const float products[6] = {x * x, x * y, x * z, y * y, y * z, z * z};
#pragma unroll
        for (int i = 0; i < 6; ++i)
            it.covariance[i] = fmaf(square[k], products[i], it.covariance[i]);
    }
    return it;
}

// Adds a small Gaussian to its cell.
__device__ __forceinline__ void join(MakeShared& shared, const MadeGroup& group, const float* position, const Seen& it,
                                     const ActiveGaussian& active, float opacity, uint32_t order)
{
    uint32_t key = 0;
    float place[3];
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        const float at = position[i] * group.per_cell - group.base[i];
        const float index = fminf(fmaxf(floorf(at), 0.0f), float(kAxisCells - 1));
        place[i] = fminf(fmaxf(at - index, 0.0f), 1.0f);
        key |= uint32_t(index) << (kAxisBits * i);
    }
    const uint32_t cell = placeOfCell(shared, key);
    if (cell == kCells)
        return;
    const float light =
        (opticalDepth(opacity) - kUndrawnDepth) * screenArea(it.trace, it.along, it.adjugate, it.scale) * group.most;
    const float weight = fmaxf(fminf(light, 1.0f) * kOne, 1.0f);
    const auto add = [&](uint32_t which, float value) { atomicAdd(&shared.sums[which][cell], __float2int_rn(value)); };
    add(kWeight, weight);
    const float unit = group.per_cell * group.per_cell;
    uint32_t moment = kMoment;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        add(kPlace + i, weight * place[i]);
        add(kColor + i, weight * active.color[i]);
#pragma unroll
        for (int j = i; j < 3; ++j, ++moment)
            add(moment, weight * fmaf(it.covariance[moment - kMoment], unit, place[i] * place[j]));
    }
    atomicMin(&shared.orders[cell], order);
}

// The sums of a cell as one Gaussian.
__device__ __forceinline__ CoarseGaussian joined(const MakeShared& shared, const MadeGroup& group,
                                                 const CoarseView& view, uint32_t cell)
{
    const auto sum = [&](uint32_t which) { return float(shared.sums[which][cell]); };
    const float weight = sum(kWeight), inverse = __fdividef(1.0f, weight);
    CoarseGaussian out;
    float mean[3];
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        mean[i] = sum(kPlace + i) * inverse;
        const float index = float(shared.keys[cell] >> (kAxisBits * i) & (kAxisCells - 1));
        out.position[i] = (group.base[i] + index + mean[i]) * group.frame.cell;
        out.color[i] = fminf(fmaxf(sum(kColor + i) * inverse, 0.0f), 1.0f);
    }
    // rounding of the sums may take so much from a sum of squares: without it, what is faint could get any shape
    const float rounding = 3.0f * inverse + 1e-6f;
    float c[6];
    uint32_t at = 0;
#pragma unroll
    for (int i = 0; i < 3; ++i)
#pragma unroll
        for (int j = i; j < 3; ++j, ++at) {
            c[at] = sum(kMoment + at) * inverse - mean[i] * mean[j];
            if (i == j) // no more than there can be of what is small, should sums not fit
                c[at] = fminf(fmaxf(c[at], 0.0f), 1.25f) + rounding;
        }
#pragma unroll
    for (int i = 0; i < 3; ++i) { // xy, xz, yz
        const uint32_t of[3] = {1, 2, 4}, first[3] = {0, 0, 3}, second[3] = {3, 5, 5};
        const float most = sqrtf(c[first[i]] * c[second[i]]);
        c[of[i]] = fminf(fmaxf(c[of[i]], -most), most);
    }
    const float square = group.frame.cell * group.frame.cell;
    for (float& entry : c)
        entry *= square;
    float direction[3];
    const float scale = __fdividef(1.0f, view.pixel_at_one * distanceTo(out.position, view.center, direction));
    const float x = direction[0], y = direction[1], z = direction[2];
    const float trace = c[0] + c[3] + c[5];
    const float along =
        c[0] * x * x + c[3] * y * y + c[5] * z * z + 2.0f * (c[1] * x * y + c[2] * x * z + c[4] * y * z);
    const float adjugate = fmaxf((c[3] * c[5] - c[4] * c[4]) * x * x + (c[0] * c[5] - c[2] * c[2]) * y * y +
                                     (c[0] * c[3] - c[1] * c[1]) * z * z +
                                     2.0f * ((c[2] * c[4] - c[1] * c[5]) * x * y + (c[1] * c[4] - c[2] * c[3]) * x * z +
                                             (c[1] * c[2] - c[0] * c[4]) * y * z),
                                 0.0f);
    const float light = weight * __fdividef(1.0f, kOne * group.most), area = screenArea(trace, along, adjugate, scale);
    const float depth = __fdividef(light, area) + kUndrawnDepth, wider = widening(depth);
    if (wider > 1.0f) {
        const float grows = growth(trace, along, adjugate, scale, wider * area);
        if (grows < kMostGrowth)
#pragma unroll
            for (float& entry : c)
                entry *= grows;
    }
    out.opacity = fminf(1.0f - __expf(-depth), kLargestOpacity);
    factorOf(c, 1e-3f * group.frame.cell, out.factor);
    out.order = shared.orders[cell];
    return out;
}

// Decodes 16 anchors and joins them. first: anchor; count: of them, 1 to 16.
template <bool kCompact, bool kBank>
__device__ __forceinline__ void makeStrip(const CoarseCudaArgs& args, MakeShared& shared, const MadeGroup& group,
                                          uint32_t level_index, uint32_t first, uint32_t count, uint32_t lane,
                                          bool& positive)
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
        anchors[r] = first + min(row, count - 1);
        const float4 p = reinterpret_cast<const float4*>(model.placement)[anchors[r]];
        positions[r][0] = p.x;
        positions[r][1] = p.y;
        positions[r][2] = p.z;
        exists[r] = row < count && levelShows<float>(model.params, model.levels[level_index].level, {p.x, p.y, p.z},
                                                     model.lod_shift[level_index], p.w, args.view.level_center,
                                                     args.lod_bias, args.lod_fade, fractions[r]);
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
    const uint32_t shown =
        __popc(__ballot_sync(~0u, exists[0] && t == 0)) + __popc(__ballot_sync(~0u, exists[1] && t == 0));
    if (lane == 0)
        atomicAdd(&shared.anchors, shown);
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
        const PlainGaussian plain = plainGaussian<kCompact>(model, first + (owner & 255u), owner >> 8);
        const ActiveGaussian active = activeGaussian(plain, [&](uint32_t which) { return staged.outputs[which][i]; });
        const Seen it = seen(args.view, plain.position, active);
        if (plain.masked || plain.order == kNoOrder ||
            !isfinite(it.trace + it.scale + active.color[0] + active.color[1] + active.color[2]))
            continue;
        ++all;
        if (fmaxf(active.sigma[0], fmaxf(active.sigma[1], active.sigma[2])) < group.frame.cell) {
            ++small;
            join(shared, group, plain.position, it, active, staged.opacities[i], plain.order);
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
    __syncwarp(); // what is staged is used again
    addOfWarp(&shared.alive, all, lane);
    addOfWarp(&shared.small, small, lane);
}

// kCompact: the model is compact. kBank: it has a feature bank, which makes the features depend on the place.
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
        const float detail = __fdividef(args.view.cell_at_one, args.view.pixel_at_one) * cell.growth;
        group.most = __fdividef(1.0f, 4.7f * (detail * detail + 0.3f));
        for (uint32_t c = threadIdx.x; c < kCells; c += kThreads) {
            shared.keys[c] = kNoKey;
            shared.orders[c] = ~0u;
#pragma unroll
            for (uint32_t s = 0; s < kSums; ++s)
                shared.sums[s][c] = 0;
        }
        if (threadIdx.x == 0) {
            shared.alive = shared.small = shared.cells = shared.gaussians = shared.anchors = 0;
            const unsigned long long from = atomicAdd(&tables.free->taken, static_cast<unsigned long long>(kMostPages));
            for (uint32_t p = 0; p < kMostPages; ++p)
                shared.pages[p] = tables.ring[(from + p) % ringRoom(tables)];
        }
        __syncthreads();
        if (fits)
#pragma unroll 1
            for (uint32_t strip = warp; 16 * strip < record.anchor_count; strip += kWarps)
                makeStrip<kCompact, kBank>(args, shared, group, record.level_index, record.anchor_first + 16 * strip,
                                           min(record.anchor_count - 16 * strip, 16u), lane, positive);
        __syncthreads();
        const uint32_t large = shared.gaussians, cells = shared.cells;
        const bool far = fits && float(shared.small) >= kFarShare * float(shared.alive) && cells <= kMostCells &&
                         large + cells <= kMostGaussians;
        __syncthreads();
        if (far)
            for (uint32_t c = threadIdx.x; c < kCells; c += kThreads)
                if (shared.keys[c] != kNoKey) {
                    const uint32_t to = atomicAdd(&shared.gaussians, 1u);
                    storeCoarse(tables.pages[shared.pages[to / kPageGaussians]], to % kPageGaussians, group.frame,
                                joined(shared, group, args.view, c));
                }
        __syncthreads();
        if (threadIdx.x == 0) {
            CoarseGroup& kept = tables.groups[index];
            const uint32_t total = far ? large + cells : 0u, pages = (total + kPageGaussians - 1) / kPageGaussians;
            givePages(tables, index, pagesOf(kept));
            uint32_t* const page_of = tables.page_of + size_t(index) * kMostPages;
            const unsigned long long to =
                atomicAdd(&tables.free->given, static_cast<unsigned long long>(kMostPages - pages));
            for (uint32_t p = 0; p < kMostPages; ++p)
                if (p < pages)
                    page_of[p] = shared.pages[p];
                else
                    tables.ring[(to + p - pages) % ringRoom(tables)] = shared.pages[p];
            kept = {keyOf(args.view, cell),
                    uint32_t(far ? CoarseKind::Far : CoarseKind::Near),
                    total,
                    shared.anchors,
                    shared.alive,
                    args.frame,
                    args.frame};
            if (far) {
                tables.drawn[atomicAdd(&counters.drawn, 1u)] = entry;
                addCoarseDepth(args, args.histogram, args.model, index, entry >> kAnchorBits, total);
                atomicAdd(&counters.groups_made, 1u);
                atomicAdd(&counters.anchors_made, shared.anchors);
            } else {
                tables.near[atomicAdd(&counters.near, 1u)] = entry;
                atomicAdd(&counters.groups_near, 1u);
            }
        }
        __syncthreads(); // what is shared is used again
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
