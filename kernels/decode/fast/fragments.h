// SPDX-License-Identifier: Apache-2.0
// Fragments of the matrix-unit decode: how it deals its work to lanes. For the packer (host) and the kernel.
//
// A row of m16n8k16 is an anchor seen from one place: 16 anchors from one, or 8 from each of two eyes. K of the first
// layer is three tiles: two of features, one of the view: direction, distance and level, the first two as a high and a low
// half so that rounding the inputs to half precision costs nothing, and two ones, whose weights are the bias as a half and
// what that leaves. The second layers' columns are dealt so that lane t of a row holds opacity, covariance and colour of the
// Gaussians t, t + 4 and t + 8 of its anchor: no shuffle follows.
#pragma once

#include <cstdint>

namespace gsc {

constexpr uint32_t kFastFeatures = 32;
constexpr uint32_t kItemsPerLane = 3;     // Gaussians per lane and anchor
constexpr uint32_t kFirstTiles = 12;      // n tiles of the fused first layer: 3 heads x 32 hidden units
constexpr uint32_t kOpacityTiles = 2;     // 3 values per lane, two per tile
constexpr uint32_t kCovarianceTiles = 11; // 21 values
constexpr uint32_t kColorTiles = 5;       // 9 values
constexpr uint32_t kSecondTiles = kOpacityTiles + kCovarianceTiles + kColorTiles;
// Fragments: for each n tile of the first layer those of both k tiles of features, a lane's beside each other; for each n
// tile of the second layers those of both k tiles; for each n tile of the first layer that of the view.
constexpr uint32_t kPairTiles = kFirstTiles + kSecondTiles;
constexpr uint32_t kFragmentTiles = 2 * kPairTiles + kFirstTiles;
constexpr uint32_t kTileHalves = 128; // 32 lanes x 4
constexpr uint32_t kBiasCount = 8 * kSecondTiles;
// Feature bank, per hidden unit: weights of direction (3), distance and level, bias, weights of the three outputs; after
// the last unit the outputs' biases.
constexpr uint32_t kBankUnits = 32, kBankStride = 12;
constexpr uint32_t kBankValues = kBankUnits * kBankStride + 4;
constexpr float kDistanceScale = 64.0f; // a half ends at 65504: the input is divided by this, its weights multiplied

} // namespace gsc
