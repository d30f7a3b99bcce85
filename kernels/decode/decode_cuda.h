// SPDX-License-Identifier: Apache-2.0
// Visible anchors to splats on a device: inputs and outputs of its decoders (kernels/decode/fast, kernels/decode/exact,
// kernels/reuse). Gather, three networks, projection and packing are one kernel.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"

namespace gsc {

// A splat as blending reads it in the tier `fast`, 32 bytes, two 16-byte loads.
struct alignas(16) PackedSplat {
    float x, y;        // 0   pixels, centres at integers
    float factor[3];   // 8   log2 of the falloff is -(factor[0] dx + factor[1] dy)^2 - (factor[2] dy)^2
    uint16_t color[3]; // 20  steps of 1 / 65535
    uint16_t opacity;  // 26  the same
    uint32_t order;    // 28  emission order, breaks depth ties
};
static_assert(sizeof(PackedSplat) == 32);
constexpr float kUnseenPlace = 6e4f; // x and y, pixels: outside every image, and still a number of 16 bits
// least determinant of an ellipse, relative to its diagonal; a smaller one is a needle
constexpr float kTrustedDeterminant = 3e-5f;

// A splat as blending reads it in the tier `exact`, 48 bytes, three 16-byte loads.
struct alignas(16) ExactSplat {
    float x, y;                  // 0
    float conic[3];              // 8
    float opacity;               // 20
    float color[3];              // 24
    uint32_t order;              // 36
    uint16_t tx0, ty0, tx1, ty1; // 40 upstream's tiles [x0, x1) x [y0, y1)
};
static_assert(sizeof(ExactSplat) == 48);

// Arrays that decoders of either tier read and write. Device pointers; rows of an eye lie slot_capacity or grid.cells() apart. In shared
// bins there is one row of places and cells, and a splat has the same slot in both eyes' rows; where an eye does not see
// it, it lies at kUnseenPlace there.
struct DecodeFrame : FrameNow {
    using Now = FrameNow;

    DeviceModel model;
    uint32_t eye_count;
    bool merged;      // StereoMode::Merged, and there are two eyes: the networks look from look_from
    bool shared_bins; // both eyes' splats share slots, places and cells; tier `fast` only
    bool thins;       // there is foveation: FrameNow::finest
    RasterConstants rules;
    BinGrid grid;
    DepthPass pass;
    const uint32_t* visible;       // visible anchors, of select or of the pass
    const float* fraction;         // opacity factor of each visible anchor, or null
    const uint32_t* visible_count; // length of `visible`; at most visible_capacity entries are stored
    uint32_t visible_capacity;
    SplatPlace* places; // eye_count x slot_capacity, or slot_capacity
    uint16_t* touches;  // eye_count x slot_capacity: touchCode() at touchPlace(); null in `exact`
    uint32_t* cells;    // eye_count x grid.cells(), or grid.cells(): splats of each, zero before
    uint32_t slot_capacity;
    FrameCounters* counters;
    const float* bank; // DecodeWeights, or null: the model has none, or it is not for the tiles
    bool takes_distance, takes_level;
};

} // namespace gsc
