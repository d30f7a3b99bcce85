// SPDX-License-Identifier: Apache-2.0
// Decodes visible anchors to splats on a device: inputs and outputs of the decoders (kernels/decode/fast,
// kernels/decode/exact, kernels/reuse). Gather, three networks, projection and packing are one kernel.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"

namespace gsc {

// A splat as blending reads it in the tier `fast`: 32 bytes, two 16-byte loads.
struct alignas(16) PackedSplat {
    float x, y;        // byte 0: centre in pixels; pixel centres are whole numbers
    float factor[3];   // byte 8: log2 of the falloff is -(factor[0] dx + factor[1] dy)^2 - (factor[2] dy)^2
    uint16_t color[3]; // byte 20: in steps of 1 / 65535
    uint16_t opacity;  // byte 26: in steps of 1 / 65535
    uint32_t order;    // byte 28: emission order, which orders splats of equal depth
};
static_assert(sizeof(PackedSplat) == 32);
// x and y in pixels of a splat that an eye does not see: outside every image, and still a number of 16 bits
constexpr float kUnseenPlace = 6e4f;
// smallest determinant of a trusted ellipse, relative to the product of its diagonal; below it a splat is a needle
constexpr float kTrustedDeterminant = 3e-5f;

// A splat as blending reads it in the tier `exact`: 48 bytes, three 16-byte loads.
struct alignas(16) ExactSplat {
    float x, y;                  // byte 0: centre in pixels; pixel centres are whole numbers
    float conic[3];              // byte 8: inverse of the covariance: xx, xy, yy
    float opacity;               // byte 20: opacity, 0 to 1
    float color[3];              // byte 24: red, green, blue
    uint32_t order;              // byte 36: emission order, which orders splats of equal depth
    uint16_t tx0, ty0, tx1, ty1; // byte 40: tiles [tx0, tx1) x [ty0, ty1) in which the trainers' code draws the splat
};
static_assert(sizeof(ExactSplat) == 48);

// Arrays that the decoders of both tiers read and write; device pointers. The rows of an eye lie slot_capacity or
// grid.cells() elements behind those of the eye before. With shared bins there is only one row of places and of cells,
// and a splat has the same slot in both eyes' rows; in the row of an eye that does not see it, it lies at kUnseenPlace.
struct DecodeFrame : FrameNow {
    using Now = FrameNow;

    DeviceModel model;
    uint32_t eye_count;
    bool merged;      // true with StereoMode::Merged and two eyes: the networks look from look_from, once for both
    bool shared_bins; // true if the splats of both eyes share slots, places and cells; only in tier `fast`
    bool thins;       // true with foveation: small splats are thinned to FrameNow::finest
    RasterConstants rules;
    BinGrid grid;
    DepthPass pass;
    const uint32_t* visible;       // visible anchors, from select or from the list of the pass
    const float* fraction;         // two opacity factors of each visible anchor, one for each eye; null if all are 1
    const uint32_t* visible_count; // number of entries in `visible`; at most visible_capacity are stored
    uint32_t visible_capacity;
    SplatPlace* places; // eye_count x slot_capacity elements, or slot_capacity with shared bins
    uint16_t* touches;  // eye_count x slot_capacity elements: touchCode() at touchPlace(); null in `exact`
    uint32_t* cells; // eye_count x grid.cells() elements, or grid.cells(): number of splats in each cell, zero before
    uint32_t slot_capacity;
    FrameCounters* counters;
    const float* bank; // DecodeWeights::bank; null if the model has none, or not the one that the tiles take
    bool takes_distance, takes_level;
};

} // namespace gsc
