// SPDX-License-Identifier: Apache-2.0
// Anchors decoded to be kept: every Gaussian of a strip, as one or two camera centres saw it, and the mix of the two.
//
// Between activations the networks are piecewise linear in the direction of view, so what an anchor decodes to on the
// way from one centre to another lies close to the line between what it decodes to at both ends: the error falls with
// the square of the way, where that of an entry drawn as it is falls with the way itself.
#pragma once

#include "kernels/decode/decode.h"
#include "kernels/schedule/schedule.h"

namespace gsc {

// A key holds, per offset, rows of kStripAnchors halves: opacity as decoded, not yet tested and without the factor of
// the level, so that a Gaussian can come to life on the way; colour; sigmoid of the scale; rotation w x y z, normalised.
// Half precision bounds the accuracy at about 80 dB.
constexpr uint32_t kStripRows = 1 + 3 + 3 + 4;

constexpr size_t stripKeyValues(uint32_t n_offsets)
{
    return size_t(kStripRows) * kStripAnchors * n_offsets;
}

// What does not depend on the view, fp32: positions, 3 rows per offset, then exp of the base scale, 3 rows.
constexpr size_t stripFixedValues(uint32_t n_offsets)
{
    return size_t(kStripAnchors) * 3 * (n_offsets + 1);
}

// Decodes the `count` <= kStripAnchors anchors args.visible for args.eye_count eyes: keys[e] for eye e, and `fixed`.
// Lanes without an anchor repeat the last.
void decodeStripCpu(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed,
                    DecodeScratch& scratch);

struct StripMix {
    const uint16_t* keys[2]; // the second is not read where `t` is 0
    float t;                 // 0 draws the first key, 1 the second; beyond that it goes on along the line
    const float* fixed;
    const float* fraction; // opacity factor per anchor, or null for 1
    uint32_t lanes;        // bit i: anchor i is drawn
    uint32_t n_offsets;
    uint32_t first_origin; // GaussianBlock::origin of offset 0 of anchor 0
};

// Appends the Gaussians whose opacity reaches kOpacityFloor; block.any_positive tells of any above zero (trap 25).
void mixStripCpu(const StripMix& mix, GaussianBlock& block);

} // namespace gsc
