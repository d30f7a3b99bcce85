// SPDX-License-Identifier: Apache-2.0
// Sizes and offsets of an anchor's Gaussians as the device holds them, in both layouts (DeviceModel). Kernels that
// decode are compiled for each layout: to choose at each load took 12 % more of their time.
#pragma once

#include "kernels/frame/device_model.h"

#include <cuda_runtime.h>

namespace gsc {

// Sizes of an anchor's Gaussians and scale of their offsets, before the networks change them.
struct AnchorShape {
    float step[3];   // world units per step of an offset
    float extent[3]; // base size of the anchor's Gaussians along their axes, world units
};

template <bool kCompact>
__device__ __forceinline__ AnchorShape anchorShape(const DeviceModel& model, size_t anchor)
{
    if constexpr (!kCompact) {
        const float2* shape = reinterpret_cast<const float2*>(model.shape + 6 * anchor);
        const float2 s0 = shape[0], s1 = shape[1], s2 = shape[2];
        return {{s0.x, s0.y, s1.x}, {s1.y, s2.x, s2.y}};
    }
    const uint2 packed = reinterpret_cast<const uint2*>(model.compact_shape)[anchor];
    const float* size = model.size + 3 * anchor;
    const float power = powerOfTwo(int32_t(packed.y) >> 24);
    return {{size[0] * power, size[1] * power, size[2] * power},
            {unpackExtent(packed.x & 0xffffu), unpackExtent(packed.x >> 16), unpackExtent(packed.y & 0xffffu)}};
}

__device__ __forceinline__ AnchorShape anchorShape(const DeviceModel& model, size_t anchor)
{
    return model.compact_shape == nullptr ? anchorShape<false>(model, anchor) : anchorShape<true>(model, anchor);
}

// Largest number of steps that an offset can have along an axis.
__device__ __forceinline__ float mostSteps(const DeviceModel& model)
{
    return model.compact_shape == nullptr ? float(kOffsetSteps) : float(kCompactOffsetSteps);
}

// Largest distance of an anchor's Gaussians from the anchor, world units.
__device__ __forceinline__ float anchorReach(const DeviceModel& model, const AnchorShape& shape)
{
    return mostSteps(model) * norm3df(shape.step[0], shape.step[1], shape.step[2]);
}

// Offset of Gaussian k from its anchor, in steps.
struct OffsetSteps {
    float along[3];
    bool masked; // true: the slot is never drawn
    bool finite;
};

template <bool kCompact>
__device__ __forceinline__ OffsetSteps offsetSteps(const DeviceModel& model, size_t anchor, uint32_t k)
{
    const size_t at = anchor * model.params.n_offsets + k;
    if constexpr (!kCompact) {
        const uint64_t offset = model.offset[at];
        const auto steps = [offset](uint32_t axis) {
            return float(int32_t(uint32_t(offset >> (kOffsetBits * axis)) & ((1u << kOffsetBits) - 1u)) - kOffsetSteps -
                         1);
        };
        return {{steps(0), steps(1), steps(2)}, offset == kMaskedSlot, offset != kNoOffset};
    }
    const uint32_t offset = model.compact_offset[at];
    const auto steps = [offset](uint32_t axis) {
        return float(int32_t(offset >> (10 * axis) & 1023u) - kCompactOffsetSteps - 1);
    };
    return {{steps(0), steps(1), steps(2)}, offset == kCompactMasked, offset != kCompactNoOffset};
}

} // namespace gsc
