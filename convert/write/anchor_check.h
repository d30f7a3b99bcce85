// SPDX-License-Identifier: Apache-2.0
// Anchors that a renderer cannot show at all, and why (format facts, traps 15, 18, 19).
#pragma once

#include "convert/input/checkpoint.h"

#include <iterator>

namespace gsc {

enum class AnchorFault : uint32_t {
    None = 0,
    NotFinite,  // NaN or infinity in position, level bias, offset, feature, scale (+inf) or rotation
    HugeScale,  // exp(scale) squared overflows fp32: upstream's covariance becomes infinite and paints the image
    HugeOffset, // a Gaussian centre overflows fp32
    OutOfReach, // position outside the range of a float grid or an index
    Count,
};
constexpr const char* kAnchorFaultTexts[] = {"no fault", "a value that is not finite",
                                             "a scale whose covariance overflows",
                                             "an offset that puts a gaussian out of reach", "a position out of reach"};
static_assert(std::size(kAnchorFaultTexts) == size_t(AnchorFault::Count));

// Square of exp(44) is the last covariance below FLT_MAX; -inf is legal and means a Gaussian of size zero.
constexpr float kMaxLogScale = 44.0f;
constexpr float kMaxCoordinate = 1e30f;

// The fault of anchor `i` of a batch that holds all fields. Opacity and normal are never looked at: they do not render.
// `masks`: slots may be masked (kModelMaskedSlots).
[[nodiscard]] AnchorFault findAnchorFault(const AnchorBatch& batch, size_t i, uint32_t feat_dim, uint32_t n_offsets,
                                          bool masks);

} // namespace gsc
