// SPDX-License-Identifier: Apache-2.0
#include "convert/write/anchor_check.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>

namespace gsc {

namespace {

// note: tests the bits without a branch, so that the loop is vectorised; every float of a checkpoint is tested here
bool allFinite(const float* values, size_t count)
{
    uint32_t bad = 0;
    for (size_t i = 0; i < count; ++i)
        bad |= uint32_t((std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) == 0x7f800000u);
    return bad == 0;
}

// Returns true if the offset of every slot is finite, or the slot is masked and `masks` allows that.
bool offsetsGood(const float* offset, uint32_t n_offsets, bool masks)
{
    if (allFinite(offset, 3 * size_t(n_offsets)))
        return true;
    const auto is_masked = [](float v) { return std::bit_cast<uint32_t>(v) == kMaskedOffset; };
    for (uint32_t k = 0; masks && k < n_offsets; ++k, offset += 3)
        if (!allFinite(offset, 3) && !(is_masked(offset[0]) && is_masked(offset[1]) && is_masked(offset[2])))
            return false;
    return masks;
}

} // namespace

AnchorFault findAnchorFault(const AnchorBatch& batch, size_t i, uint32_t feat_dim, uint32_t n_offsets, bool masks)
{
    const float* position = &batch.position[3 * i];
    const float* scale = &batch.scale[6 * i];
    const float* offset = &batch.offset[3 * n_offsets * i];
    if (!allFinite(position, 3) || !allFinite(&batch.extra_level[i], 1) || !allFinite(&batch.rotation[4 * i], 4) ||
        !offsetsGood(offset, n_offsets, masks) || !allFinite(&batch.feature[size_t(feat_dim) * i], feat_dim))
        return AnchorFault::NotFinite;
    for (int c = 0; c < 6; ++c)
        if (!(scale[c] <= FLT_MAX)) // true for NaN and +inf
            return AnchorFault::NotFinite;
    for (int c = 0; c < 6; ++c)
        if (scale[c] > kMaxLogScale)
            return AnchorFault::HugeScale;
    for (int axis = 0; axis < 3; ++axis)
        if (std::fabs(position[axis]) > kMaxCoordinate)
            return AnchorFault::OutOfReach;
    for (int axis = 0; axis < 3; ++axis) {
        float largest = 0;
        for (uint32_t k = 0; k < n_offsets; ++k)
            largest = std::max(largest, std::fabs(offset[3 * k + axis]));
        // real offsets are below 1e10, so the logarithm is rarely needed; with exp(scale) at most exp(44) < 2^64 their
        // product is far below the limit
        if (largest > 1e10f && std::log(double(largest)) + double(scale[axis]) > 69.0) // logarithm of 1e30
            return AnchorFault::HugeOffset;
    }
    return AnchorFault::None;
}

} // namespace gsc
