// SPDX-License-Identifier: Apache-2.0
// Decodes strips to be kept. A key is every Gaussian of a strip as seen from one camera centre. Strips are drawn at one
// key or between two (packed_strip.h).
//
// Between activations the networks are piecewise linear in the direction of view, so what an anchor decodes to on the
// way from one centre to another lies close to the line between what it decodes to at both ends: the error falls with
// the square of the way, where that of an entry drawn as it is falls with the way itself.
#pragma once

#include "kernels/decode/decode.h"
#include "kernels/reuse/schedule.h"

namespace gsc {

// Rows of a key, of kStripAnchors half floats each, which are repeated for each offset: opacity as decoded (not tested,
// without the factor of the level, so that a Gaussian can become visible between keys); colour; sigmoid of the scale;
// rotation w x y z, normalised. Half precision limits the accuracy to about 80 dB.
constexpr uint32_t kOpacityRow = 0, kColorRow = 1, kScaleRow = 4, kRotationRow = 7, kStripRows = 11;

constexpr float kNoOpacity = -65504; // opacity of an anchor at the camera, which draws nothing (format facts, trap 17)

constexpr size_t stripKeyValues(uint32_t n_offsets)
{
    return size_t(kStripRows) * kStripAnchors * n_offsets;
}

// Number of a strip's fp32 values that do not depend on the view: 3 rows of positions for each offset, then 3 rows of
// exp(base scale).
constexpr size_t stripFixedValues(uint32_t n_offsets)
{
    return size_t(kStripAnchors) * 3 * (n_offsets + 1);
}

// Decodes the `count` <= kStripAnchors anchors in args.visible for args.eye_count eyes. Writes keys[e] for eye e, and
// `fixed`, the values that do not depend on the view. Lanes without an anchor repeat the last one.
void decodeStripCpu(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed,
                    DecodeScratch& scratch);

} // namespace gsc
