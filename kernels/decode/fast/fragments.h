// SPDX-License-Identifier: Apache-2.0
// Fragments of the decoder on matrix units: how its work is dealt out to lanes. Used by the packer, on the host, and by
// the kernel.
//
// A row of m16n8k16 is an anchor seen from one place: 16 anchors from one, or 8 from each of two eyes. K of the first
// layer is three tiles: two of features, one of the view: direction, distance and level, the first two as a high and a
// low half so that rounding the inputs to half precision costs nothing, and two ones, whose weights are the bias as a
// half and what that leaves. The second layers' columns are dealt so that lane t of a row holds opacity, covariance and
// colour of the Gaussians t, t + 4 and t + 8 of its anchor: no shuffle follows.
#pragma once

#include <cstdint>

namespace gsc {

constexpr uint32_t kFastFeatures = 32;
constexpr uint32_t kItemsPerLane = 3;     // Gaussians of an anchor that one of its four lanes has
constexpr uint32_t kFirstTiles = 12;      // n tiles of the fused first layer: 3 heads x 32 hidden units
constexpr uint32_t kOpacityTiles = 2;     // n tiles for 3 values per lane, two in each tile
constexpr uint32_t kCovarianceTiles = 11; // n tiles for 21 values per lane
constexpr uint32_t kColorTiles = 5;       // n tiles for 9 values per lane
constexpr uint32_t kSecondTiles = kOpacityTiles + kCovarianceTiles + kColorTiles;
// Order of the fragments: for each n tile of the first layer those of both k tiles of features, a lane's beside each
// other; then for each n tile of the second layers those of both k tiles; then for each n tile of the first layer that
// of the view.
constexpr uint32_t kPairTiles = kFirstTiles + kSecondTiles;
constexpr uint32_t kFragmentTiles = 2 * kPairTiles + kFirstTiles;
constexpr uint32_t kTileHalves = 128; // half floats of a fragment: 32 lanes x 4
constexpr uint32_t kBiasCount = 8 * kSecondTiles;
// Feature bank: for each hidden unit the weights of direction (3), distance and level, the bias, and the weights of the
// three outputs; behind the last unit the biases of the outputs.
constexpr uint32_t kBankUnits = 32, kBankStride = 12;
constexpr uint32_t kBankValues = kBankUnits * kBankStride + 4;
// distances are divided by this, and their weights multiplied, because a half float ends at 65504
constexpr float kDistanceScale = 64.0f;

} // namespace gsc
