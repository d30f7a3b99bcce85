// SPDX-License-Identifier: Apache-2.0
// Tools of the tests of the CUDA stages: a model on the device, and the host's view of what stages hand on.
#pragma once

#include "runtime/cuda/device/device_scene.h"
#include "tests/kernels/gpu_buffers.h"
#include "tests/kernels/gpu_tools.h"

#include <cmath>
#include <cstring>

namespace gsc::test {

// Sizes the launches: so few that every loop of a kernel runs more than once, and an emulated device is quick.
constexpr uint32_t kTestProcessors = 2;

// The model as the stages read it.
struct StageModel {
    MemoryBudget budget;
    DeviceScene scene{budget, 2};

    explicit StageModel(const ModelView& view) { scene.load(view, testStream()); }
};

inline uint32_t floatBits(float v)
{
    uint32_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    return bits;
}

inline float bitsFloat(uint32_t bits)
{
    float v;
    std::memcpy(&v, &bits, sizeof v);
    return v;
}

// A number from 0 to 1 in the steps that colours and opacities are packed in.
inline uint16_t floatSteps(float v)
{
    return uint16_t(std::nearbyint(v * 65535.0f));
}
inline float stepsFloat(uint16_t steps)
{
    return float(steps) * (1.0f / 65535.0f);
}

// depthBucket() of the kernels.
inline uint32_t bucketOf(uint32_t depth_bits)
{
    const int bucket = int(depth_bits >> 13) - ((127 - 4) << 10);
    return uint32_t(std::min(std::max(bucket, 0), int(kDepthBuckets) - 1));
}

// Buckets from `near_z` to `far_z` dealt evenly to slabs.
inline std::vector<uint16_t> evenSlabs(float near_z, float far_z, uint32_t slabs)
{
    const double first = bucketOf(floatBits(near_z)), last = bucketOf(floatBits(far_z));
    std::vector<uint16_t> slab_of(kDepthBuckets);
    for (uint32_t b = 0; b < kDepthBuckets; ++b)
        slab_of[b] = uint16_t(std::clamp((b - first) / (last - first + 1) * slabs, 0.0, slabs - 1.0));
    return slab_of;
}

inline BinGrid gridOf(const std::vector<EyeParams>& eyes, uint32_t height, uint32_t slab_bits)
{
    BinGrid grid{0, 0, height, slab_bits};
    for (const EyeParams& eye : eyes) {
        grid.columns = std::max(grid.columns, (eye.width + kBinWidth - 1) / kBinWidth);
        grid.rows = std::max(grid.rows, (eye.height + height - 1) / height);
    }
    return grid;
}

struct BinBox {
    uint32_t x0, y0, x1, y1; // inclusive
};

inline BinBox unpackBox(uint32_t box)
{
    return {box & 255u, box >> 8 & 255u, box >> 16 & 255u, box >> 24};
}

inline bool isInGrid(const BinBox& box, const BinGrid& grid)
{
    return box.x0 <= box.x1 && box.y0 <= box.y1 && box.x1 < grid.columns && box.y1 < grid.rows;
}

// visit(cell) for every cell of an eye that a splat lies in.
template <typename Visit>
void forCells(const BinGrid& grid, const std::vector<uint16_t>& slab_of, const SplatPlace& place, Visit visit)
{
    if (place.box == kNoBins)
        return;
    const BinBox box = unpackBox(place.box);
    const uint32_t slab = slab_of[bucketOf(place.depth_bits)] & (grid.slabs() - 1);
    for (uint32_t y = box.y0; y <= box.y1; ++y)
        for (uint32_t x = box.x0; x <= box.x1; ++x)
            visit(((y * grid.columns + x) << grid.slab_bits) + slab);
}

} // namespace gsc::test
