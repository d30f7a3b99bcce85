// SPDX-License-Identifier: Apache-2.0
// Finds anchors that a renderer cannot show at all, and why.
#pragma once

#include "convert/input/checkpoint.h"

#include <iterator>

namespace gsc {

enum class AnchorFault : uint32_t {
    None = 0,
    NotFinite, // NaN or infinity in position, level bias, offset, feature, scale (+inf) or rotation
    // exp(scale) squared overflows fp32: the trainer's covariance becomes infinite and covers the whole picture
    HugeScale,
    HugeOffset, // the centre of one of its Gaussians overflows fp32
    OutOfReach, // position beyond kMaxCoordinate
    Count,
};
constexpr const char* kAnchorFaultTexts[] = {"no fault", "a value that is not finite",
                                             "a scale whose covariance overflows",
                                             "an offset that puts a gaussian out of reach", "a position out of reach"};
static_assert(std::size(kAnchorFaultTexts) == size_t(AnchorFault::Count));

// Largest logarithm of a scale: the square of exp(44) is just below FLT_MAX. -inf is allowed and means a Gaussian of
// size zero.
constexpr float kMaxLogScale = 44.0f;
constexpr float kMaxCoordinate = 1e30f;

// Returns the first fault of anchor `i` of a batch that holds all fields. Opacity and normal are not tested, because
// they are not drawn. `masks`: slots may be masked (kModelMaskedSlots).
[[nodiscard]] AnchorFault findAnchorFault(const AnchorBatch& batch, size_t i, uint32_t feat_dim, uint32_t n_offsets,
                                          bool masks);

} // namespace gsc
