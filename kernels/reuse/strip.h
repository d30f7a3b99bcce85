// SPDX-License-Identifier: Apache-2.0
// Anchors decoded to be kept: every Gaussian of a strip as a camera centre saw it, a key. Strips are drawn at one key or
// between two (packed_strip.h).
//
// Between activations the networks are piecewise linear in the direction of view, so what an anchor decodes to on the
// way from one centre to another lies close to the line between what it decodes to at both ends: the error falls with
// the square of the way, where that of an entry drawn as it is falls with the way itself.
#pragma once

#include "kernels/decode/decode.h"
#include "kernels/reuse/schedule.h"

namespace gsc {

// A key holds, per offset, rows of kStripAnchors halves: opacity as decoded, not yet tested and without the factor of
// the level, so that a Gaussian can come to life on the way; colour; sigmoid of the scale; rotation w x y z, normalised.
// Half precision bounds the accuracy at about 80 dB.
constexpr uint32_t kOpacityRow = 0, kColorRow = 1, kScaleRow = 4, kRotationRow = 7, kStripRows = 11;

constexpr float kNoOpacity = -65504; // opacity of an anchor that the camera lies on, which draws nothing (trap 17)

constexpr size_t stripKeyValues(uint32_t n_offsets)
{
    return size_t(kStripRows) * kStripAnchors * n_offsets;
}

// Number of a strip's fp32 values that do not depend on the view: positions, 3 rows per offset, then exp of the base
// scale, 3 rows.
constexpr size_t stripFixedValues(uint32_t n_offsets)
{
    return size_t(kStripAnchors) * 3 * (n_offsets + 1);
}

// Decodes the `count` <= kStripAnchors anchors args.visible for args.eye_count eyes: keys[e] for eye e, and `fixed`.
// Lanes without an anchor repeat the last.
void decodeStripCpu(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed,
                    DecodeScratch& scratch);

} // namespace gsc
