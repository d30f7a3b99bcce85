// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select_cuda.h"

#include "kernels/common/depth_cells.cuh"
#include "kernels/common/launch.cuh"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"

#include <algorithm>
#include <type_traits>

namespace gsc {

namespace {

constexpr uint32_t kGroupThreads = 256;
constexpr uint32_t kThreads = kGroupSize;    // one thread per anchor of a group
constexpr uint32_t kBlocksPerProcessor = 16; // of kThreads threads: all that a multiprocessor holds

// Can the group hold an anchor upstream would show to this eye? Errs towards yes: every bound is widened by more than
// fp32 rounding can move it.
__device__ bool groupMayShow(const SelectCudaArgs& args, const GroupRecord& group, const EyeParams& eye)
{
    const Vec3<float> c{0.5f * (group.anchor_min[0] + group.anchor_max[0]),
                        0.5f * (group.anchor_min[1] + group.anchor_max[1]),
                        0.5f * (group.anchor_min[2] + group.anchor_max[2])};
    const float hx = group.anchor_max[0] - c.x, hy = group.anchor_max[1] - c.y, hz = group.anchor_max[2] - c.z;
    const float size =
        fabsf(c.x) + fabsf(c.y) + fabsf(c.z) + fabsf(eye.center[0]) + fabsf(eye.center[1]) + fabsf(eye.center[2]);
    const float radius = sqrtf(hx * hx + hy * hy + hz * hz) * 1.001f + size * 4e-6f;

    const ModelParams& params = args.model.params;
    if ((params.flags & kModelHasLevels) && params.level_rule != uint32_t(LevelRule::None)) {
        const float shift = args.model.lod_shift[group.level_index];
        const float dx = c.x + shift - eye.center[0], dy = c.y + shift - eye.center[1],
                    dz = c.z + shift - eye.center[2];
        const float nearest = fmaxf(sqrtf(dx * dx + dy * dy + dz * dz) * 0.999f - radius, 0.0f) * params.lod_scale;
        float level = log2f(params.standard_dist / nearest);
        if (params.fork != 2)
            level *= 1.0f / log2f(float(params.fork));
        const float predicted = level + group.extra_level_max + args.lod_bias + 1e-3f;
        if (args.model.levels[group.level_index].level >
            chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp, args.lod_fade).level)
            return false;
    }

    const Vec3<float> t = viewPoint<float>(eye, c);
    if (t.z + radius <= args.rules.near_z)
        return false;
    const float nearest_z = fmaxf(t.z - radius, args.rules.near_z);
    const float lx = fabsf(eye.tan_mid_x) + 1.3f * eye.tan_fov_x, ly = fabsf(eye.tan_mid_y) + 1.3f * eye.tan_fov_y;
    const float focal = fmaxf(eye.focal_x, eye.focal_y);
    const float sigma = focal * group.anchor_sigma_max / nearest_z;
    // 3 sigma of the larger axis, the eigenvalue floor, rounding up, and a tile
    const float reach = 3.0f * sqrtf(sigma * sigma * (1.0f + lx * lx + ly * ly) + 1.0f) * 1.01f + 2.0f + kTileSize;
    if (!(reach < 1e6f))
        return true;
    const float wx = 0.5f * float(eye.width) + reach, wy = 0.5f * float(eye.height) + reach;
    // the two planes of a side lean by what the image's middle is off the axis; the longer normal serves both
    const float ox = eye.focal_x * eye.tan_mid_x, oy = eye.focal_y * eye.tan_mid_y;
    const float sx = wx + fabsf(ox), sy = wy + fabsf(oy);
    const float nx = radius * sqrtf(eye.focal_x * eye.focal_x + sx * sx);
    const float ny = radius * sqrtf(eye.focal_y * eye.focal_y + sy * sy);
    return fabsf(t.x * eye.focal_x - t.z * ox) - t.z * wx <= nx * 1.001f &&
           fabsf(t.y * eye.focal_y - t.z * oy) - t.z * wy <= ny * 1.001f;
}

__global__ void __launch_bounds__(kGroupThreads) groupKernel(const __grid_constant__ SelectCudaArgs args)
{
    const uint32_t lane = threadIdx.x & 31u;
    uint32_t tested[kMaxEyes] = {};
    // whole warps stay in the loop: they vote
    for (uint32_t first = blockIdx.x * kGroupThreads + (threadIdx.x & ~31u); first < args.group_count;
         first += gridDim.x * kGroupThreads) {
        const uint32_t i = first + lane;
        uint32_t eyes = 0;
        if (i < args.group_count) {
            const GroupRecord group = args.model.groups[i];
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if (e < args.eye_count && groupMayShow(args, group, args.eyes[e])) {
                    eyes |= 1u << e;
                    tested[e] += group.anchor_count;
                }
        }
        const uint32_t any = __ballot_sync(~0u, eyes != 0);
        uint32_t base = 0;
        if (lane == 0 && any != 0)
            base = atomicAdd(&args.counters->groups_visible, uint32_t(__popc(any)));
        base = __shfl_sync(~0u, base, 0);
        if (eyes != 0)
            args.visible_groups[base + __popc(any & ((1u << lane) - 1u))] = i | eyes << kAnchorBits;
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const uint32_t sum = __reduce_add_sync(~0u, tested[e]);
        if (lane == 0 && sum != 0)
            atomicAdd(&args.counters->anchors_tested[e], sum);
    }
}

// Does footprint() surely say that the anchor is visible? For the many whose middle lies in the image and whose ellipse is
// none that rounding could flatten: then its determinant is above zero, so that its square has a width, and a tile. Every
// bound is far from where rounding could make it wrong. Upstream's first rasteriser alone.
__device__ __forceinline__ bool surelyVisible(const RasterConstants& rules, const EyeParams& eye, const Vec3<float>& p,
                                              const float* scale)
{
    const Vec3<float> t = viewPoint<float>(eye, p);
    if (rules.gsplat || !(t.z > rules.near_z) || !(t.z > 0.0f && t.z < 1e30f))
        return false;
    const float lx = fabsf(eye.tan_mid_x) + 1.3f * eye.tan_fov_x, ly = fabsf(eye.tan_mid_y) + 1.3f * eye.tan_fov_y;
    const float inv_z = __fdividef(1.0f, t.z), focal = fmaxf(eye.focal_x, eye.focal_y);
    const float size =
        fabsf(p.x) + fabsf(p.y) + fabsf(p.z) + fabsf(eye.center[0]) + fabsf(eye.center[1]) + fabsf(eye.center[2]);
    // pixels; upstream projects by another matrix
    const float margin = 2.0f + 4e-6f * focal * size * inv_z * (1.0f + fmaxf(lx, ly));
    const float x = eye.focal_x * t.x * inv_z + axisPixel(eye.width, eye.focal_x, eye.tan_mid_x);
    const float y = eye.focal_y * t.y * inv_z + axisPixel(eye.height, eye.focal_y, eye.tan_mid_y);
    if (!(x > margin && y > margin && float(eye.width) - x > margin && float(eye.height) - y > margin))
        return false;
    // pixels of its largest axis; the matrix it is projected with is at most (focal / z)^2 (1 + lx^2 + ly^2)
    const float sigma = focal * inv_z * fmaxf(fabsf(scale[0]), fmaxf(fabsf(scale[1]), fabsf(scale[2])));
    const float sum = scale[0] + scale[1] + scale[2]; // not a number if one of them is none
    return sum == sum && sigma * sigma * (1.0f + lx * lx + ly * ly) < 1e4f;
}

__device__ bool anchorVisible(const SelectCudaArgs& args, const EyeParams& eye, uint32_t anchor, int32_t level,
                              float lod_shift, const float4& placement, float& fraction)
{
    const ModelParams& params = args.model.params;
    const Vec3<float> p{placement.x, placement.y, placement.z};
    fraction = 1.0f;
    if ((params.flags & kModelHasLevels) && params.level_rule != uint32_t(LevelRule::None)) {
        const float predicted = predictedLevel<float>(params, p, lod_shift, eye.center, placement.w, args.lod_bias);
        const LevelChoice<float> choice =
            chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp, args.lod_fade);
        if (level > choice.level)
            return false;
        if (level == choice.level)
            fraction = choice.fraction;
    }
    const float* size = args.model.size + size_t(3) * anchor;
    const float scale[3] = {size[0], size[1], size[2]};
    const float* rotation = args.model.rotation;
    const float* turned = params.constant_rotation;
    if (rotation == nullptr && fabsf(turned[0] + turned[1] + turned[2] + turned[3]) < INFINITY &&
        surelyVisible(args.rules, eye, p, scale))
        return true;
    float q[4];
    for (int i = 0; i < 4; ++i)
        q[i] = rotation != nullptr ? rotation[size_t(4) * anchor + i] : params.constant_rotation[i];
    normalizeQuaternion(q);
    return footprint<float>(eye, args.rules, p, scale, q).visible;
}

// Notes what is seen of a strip for the next frame. Returns the anchors the frame before did not see, of both eyes.
__device__ uint32_t freshLanes(const StripSelectArgs& args, const ListedStrip& listed)
{
    const SeenStrip before = args.tables.seen[(args.frame - 1) & 1u][listed.strip];
    args.tables.seen[args.frame & 1u][listed.strip] = {listed.lanes, args.frame};
    return __popc(listed.lanes & ~(before.frame == args.frame - 1 ? before.lanes : 0u));
}

// Args: SelectCudaArgs, which lists anchors, or StripSelectArgs, which lists their strips.
template <typename Args>
__global__ void __launch_bounds__(kThreads) anchorKernel(const __grid_constant__ Args args)
{
    constexpr bool kStrips = std::is_same_v<Args, StripSelectArgs>;
    __shared__ uint32_t warp_count[kThreads / 32];
    __shared__ uint32_t base;
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    const uint32_t count = args.counters->groups_visible;
    uint32_t seen[kMaxEyes] = {}, fresh = 0;
    for (uint32_t i = blockIdx.x; i < count; i += gridDim.x) {
        const uint32_t entry = args.visible_groups[i];
        const GroupRecord& group = args.model.groups[entry & ((1u << kAnchorBits) - 1)];
        const uint32_t anchor = group.anchor_first + threadIdx.x;
        uint32_t eyes = 0;
        float fraction[kMaxEyes] = {1.0f, 1.0f};
        float4 placement{};
        if (threadIdx.x < group.anchor_count) {
            placement = reinterpret_cast<const float4*>(args.model.placement)[anchor];
            const float shift = args.model.lod_shift[group.level_index];
            const int32_t level = args.model.levels[group.level_index].level;
            for (uint32_t e = 0; e < args.eye_count; ++e)
                if ((entry >> kAnchorBits & 1u << e) != 0 &&
                    anchorVisible(args, args.eyes[e], anchor, level, shift, placement, fraction[e]))
                    eyes |= 1u << e;
        }
        const uint32_t any = __ballot_sync(~0u, eyes != 0);
        const uint32_t left = __ballot_sync(~0u, (eyes & 1u) != 0), right = __ballot_sync(~0u, (eyes & 2u) != 0);
        const bool half = (any >> (lane & 16u) & 0xffffu) != 0; // something of this lane's strip
        const bool first_half = (any & 0xffffu) != 0;
        if (lane == 0) {
            warp_count[warp] = kStrips ? uint32_t(first_half) + uint32_t(any >> 16 != 0) : __popc(any);
            seen[0] += __popc(left);
            seen[1] += __popc(right);
        }
        // a group is compact: the first of a warp's anchors stands for all
#pragma unroll
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            const uint32_t mask = e == 0 ? left : right;
            if (mask != 0 && lane == uint32_t(__ffs(int(mask)) - 1)) {
                const float z = viewPoint<float>(args.eyes[e], {placement.x, placement.y, placement.z}).z;
                atomicAdd(args.histogram + depthBucket(__float_as_uint(fmaxf(z, 0.0f))), uint32_t(__popc(mask)));
            }
        }
        __syncthreads();
        if (threadIdx.x == 0) {
            uint32_t total = 0;
            for (uint32_t w = 0; w < kThreads / 32; ++w)
                total += warp_count[w];
            uint32_t* listed = &args.counters->anchors_listed;
            if constexpr (kStrips)
                listed = &args.tables.scratch->counters.strips;
            base = total != 0 ? atomicAdd(listed, total) : 0;
        }
        __syncthreads();
        uint32_t slot = base + (kStrips ? (lane < 16 ? 0u : uint32_t(first_half)) : __popc(any & ((1u << lane) - 1u)));
        for (uint32_t w = 0; w < warp; ++w)
            slot += warp_count[w];
        if constexpr (kStrips) {
            if (half && (lane & 15u) == 0) {
                const uint32_t strip = threadIdx.x / kStripAnchors;
                const ListedStrip listed{(entry & ((1u << kAnchorBits) - 1)) * kStripsPerGroup + strip, anchor,
                                         (left >> lane & 0xffffu) | (right >> lane) << 16,
                                         min(group.anchor_count - threadIdx.x, kStripAnchors)};
                args.tables.listed[slot] = listed;
                if (args.counts_fresh)
                    fresh += freshLanes(args, listed);
            }
            if (half && args.fraction != nullptr)
                for (uint32_t e = 0; e < kMaxEyes; ++e)
                    args.fraction[(size_t(slot) * kMaxEyes + e) * kStripAnchors + (lane & 15u)] = fraction[e];
        } else if (eyes != 0) {
            if (slot < args.capacity) {
                args.visible[slot] = anchor | eyes << kAnchorBits;
                if (args.fraction != nullptr) {
                    args.fraction[2 * slot] = fraction[0];
                    args.fraction[2 * slot + 1] = fraction[1];
                }
            } else {
                atomicOr(&args.counters->overflow, kVisibleOverflow);
            }
        }
        __syncthreads(); // warp_count and base are reused
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if (seen[e] != 0)
            atomicAdd(&args.counters->anchors_visible[e], seen[e]);
    if constexpr (kStrips)
        if (fresh != 0)
            atomicAdd(&args.tables.scratch->counters.fresh, fresh);
}

// Sized by capacity: the count is still on its way, and blocks without a group leave at once.
uint32_t anchorBlocks(const SelectCudaArgs& args, uint32_t processors)
{
    return std::max(std::min(args.group_count, processors * kBlocksPerProcessor), 1u);
}

} // namespace

void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const uint32_t blocks = std::min((args.group_count + kGroupThreads - 1) / kGroupThreads, 8 * processors);
    launchCuda(groupKernel, std::max(blocks, 1u), kGroupThreads, 0, stream, args);
}

void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(anchorKernel<SelectCudaArgs>, anchorBlocks(args, processors), kThreads, 0, stream, args);
}

void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(anchorKernel<StripSelectArgs>, anchorBlocks(args, processors), kThreads, 0, stream, args);
}

} // namespace gsc
