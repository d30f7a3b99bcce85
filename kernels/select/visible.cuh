// SPDX-License-Identifier: Apache-2.0
// Tests of selection on the device: of the bounds of a chunk or a group, and of one anchor.
#pragma once

#include "kernels/cuda/anchor_shape.cuh"
#include "kernels/math/band.h"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"
#include "kernels/select/select_cuda.h"

#include <cuda_runtime.h>

namespace gsc {

__device__ __forceinline__ bool mayTouch(const EyeBand& band, const GroupRecord& group)
{
    return mayTouch(band, group.gaussian_min, group.gaussian_max, group.gaussian_sigma_max);
}

__device__ __forceinline__ bool mayTouch(const EyeBand& band, const GroupRun& run)
{
    float low[3], high[3];
    for (int i = 0; i < 3; ++i) {
        low[i] = run.anchor_min[i] - run.gaussian_margin;
        high[i] = run.anchor_max[i] + run.gaussian_margin;
    }
    return mayTouch(band, low, high, run.gaussian_sigma_max);
}

// Returns true if a Gaussian of the anchor can touch a tile of the band. It uses the anchor's largest offsets, so it
// may also return true if none can.
__device__ __forceinline__ bool anchorMayTouch(const DeviceModel& model, const EyeBand& band, uint32_t anchor,
                                               const float4& placement)
{
    if (band.whole)
        return true;
    const AnchorShape shape = anchorShape(model, anchor);
    const float steps = mostSteps(model) * 1.00001f;
    const float x = steps * shape.step[0], y = steps * shape.step[1], z = steps * shape.step[2];
    const float low[3] = {placement.x - x, placement.y - y, placement.z - z};
    const float high[3] = {placement.x + x, placement.y + y, placement.z + z};
    return mayTouch(band, low, high, fmaxf(shape.extent[0], fmaxf(shape.extent[1], shape.extent[2])));
}

// Returns true if a chunk (given by one of its runs) or a group can hold an anchor that the trainers' code would show
// to eye `e`, in the columns that are drawn. May also return true if it holds none: every bound is widened by more than
// fp32 rounding can change.
template <typename Record>
__device__ __forceinline__ bool mayShow(const SelectCudaArgs& args, const Record& record, uint32_t e)
{
    const EyeParams& eye = args.level_eyes[e];
    if (!mayTouch(args.bands[e], record))
        return false;
    const Vec3<float> c{0.5f * (record.anchor_min[0] + record.anchor_max[0]),
                        0.5f * (record.anchor_min[1] + record.anchor_max[1]),
                        0.5f * (record.anchor_min[2] + record.anchor_max[2])};
    const float hx = record.anchor_max[0] - c.x, hy = record.anchor_max[1] - c.y, hz = record.anchor_max[2] - c.z;
    const float size =
        fabsf(c.x) + fabsf(c.y) + fabsf(c.z) + fabsf(eye.center[0]) + fabsf(eye.center[1]) + fabsf(eye.center[2]);
    const float radius = sqrtf(hx * hx + hy * hy + hz * hz) * 1.001f + size * 4e-6f;

    const ModelParams& params = args.model.params;
    if ((params.flags & kModelHasLevels) && params.level_rule != uint32_t(LevelRule::None)) {
        const float shift = args.model.lod_shift[record.level_index];
        const float dx = c.x + shift - eye.center[0], dy = c.y + shift - eye.center[1],
                    dz = c.z + shift - eye.center[2];
        const float nearest = fmaxf(sqrtf(dx * dx + dy * dy + dz * dz) * 0.999f - radius, 0.0f) * params.lod_scale;
        float level = log2f(params.standard_dist / nearest);
        if (params.fork != 2)
            level *= 1.0f / log2f(float(params.fork));
        const float predicted = level + record.extra_level_max + args.lod_bias + 1e-3f;
        if (args.model.levels[record.level_index].level >
            chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp, args.lod_fade).level)
            return false;
    }

    const Vec3<float> t = viewPoint<float>(eye, c);
    // a view that scales or shears makes boxes and anchors larger by at most this
    const float stretch = sqrtf(viewStretch(eye.world_to_view)), reach_of_box = radius * stretch;
    if (t.z + reach_of_box <= args.rules.near_z)
        return false;
    const float nearest_z = fmaxf(t.z - reach_of_box, args.rules.near_z);
    const float lx = fabsf(eye.tan_mid_x) + 1.3f * eye.tan_fov_x, ly = fabsf(eye.tan_mid_y) + 1.3f * eye.tan_fov_y;
    const float focal = fmaxf(eye.focal_x, eye.focal_y);
    const float sigma = focal * record.anchor_sigma_max * stretch / nearest_z;
    // 3 sigma of the larger axis, the eigenvalue floor, rounding up, and a tile
    const float reach = 3.0f * sqrtf(sigma * sigma * (1.0f + lx * lx + ly * ly) + 1.0f) * 1.01f + 2.0f + kTileSize;
    if (!(reach < 1e6f))
        return true;
    const float wx = 0.5f * float(eye.width) + reach, wy = 0.5f * float(eye.height) + reach;
    // if the image's middle lies off the axis, the two planes of a side have normals of different lengths; the longer
    // one is used for both
    const float ox = eye.focal_x * eye.tan_mid_x, oy = eye.focal_y * eye.tan_mid_y;
    const float sx = wx + fabsf(ox), sy = wy + fabsf(oy);
    const float nx = reach_of_box * sqrtf(eye.focal_x * eye.focal_x + sx * sx);
    const float ny = reach_of_box * sqrtf(eye.focal_y * eye.focal_y + sy * sy);
    return fabsf(t.x * eye.focal_x - t.z * ox) - t.z * wx <= nx * 1.001f &&
           fabsf(t.y * eye.focal_y - t.z * oy) - t.z * wy <= ny * 1.001f;
}

// Returns true if footprint() surely says that the anchor is visible. It is a quick test for the many anchors whose
// centre lies in the image and whose ellipse rounding cannot flatten: the determinant is then above zero, so that the
// anchor's square has a width and touches a tile. Every bound is far from where rounding could make it wrong. For the
// trainers' first rasteriser only, not for gsplat.
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
    // in pixels; covers that the trainers' code projects with another matrix
    const float margin = 2.0f + 4e-6f * focal * size * inv_z * (1.0f + fmaxf(lx, ly));
    const float x = eye.focal_x * t.x * inv_z + axisPixel(eye.width, eye.focal_x, eye.tan_mid_x);
    const float y = eye.focal_y * t.y * inv_z + axisPixel(eye.height, eye.focal_y, eye.tan_mid_y);
    if (!(x > margin && y > margin && float(eye.width) - x > margin && float(eye.height) - y > margin))
        return false;
    // largest standard deviation in pixels; the matrix that projects it is at most (focal / z)^2 (1 + lx^2 + ly^2)
    const float sigma = focal * inv_z * fmaxf(fabsf(scale[0]), fmaxf(fabsf(scale[1]), fabsf(scale[2])));
    const float sum = scale[0] + scale[1] + scale[2]; // NaN if one of the three is NaN
    return sum == sum && sigma * sigma * (1.0f + lx * lx + ly * ly) < 1e4f;
}

__device__ inline bool anchorVisible(const SelectCudaArgs& args, const EyeParams& eye, uint32_t anchor, int32_t level,
                                     float lod_shift, const float4& placement, float& fraction)
{
    const ModelParams& params = args.model.params;
    const Vec3<float> p{placement.x, placement.y, placement.z};
    if (!levelShows<float>(params, level, p, lod_shift, placement.w, eye.center, args.lod_bias, args.lod_fade,
                           fraction))
        return false;
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

} // namespace gsc
