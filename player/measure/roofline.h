// SPDX-License-Identifier: Apache-2.0
// Least work of the stages of a frame, in bytes and operations, and the least time for it under a device's ceilings.
//
// Bytes are those that cross device memory between the kernels of two stages, each byte once. Both eyes share one pass over
// groups and anchors; the count of the larger eye stands for their union, which is a little more. Names: G, T, V: groups
// tested, anchors tested and anchors visible, in the larger eye; S, P, E: Gaussians visible, (tile, splat) pairs and blend
// evaluations, sums over the eyes; F, K, H: features, Gaussians per anchor, hidden units.
//
//   select   reads 80 G + (16 + 12) T  group records; position with level, and the three sizes the test needs
//            writes 4 V                 list of visible anchors
//   decode   reads V (4 + 2 (F + 3 K) + 16 + 24)  list; features and offsets as halves; position; sizes
//            writes S (32 + 8)          splat; depth and tile box
//            matrix units 2 (V F 3 H + sum over eyes of V_e (v H + H 11 K))  FLOP: the features' part of the first
//            layer is common to both eyes; v = inputs that depend on the eye (direction, distance, level), of the
//            three heads together. An appearance is part of the bias.
//   bin      reads 8 S, writes 8 P      depth and tile box; key of a pair
//   sort     reads 8 P, writes 8 P
//   blend    reads (32 + 4) P           splat and its index; 40 P if it sorts too, on chip, and sort takes no time
//            writes 12 per pixel
//            lanes 14 E, exponentials E
//
// The tier exact reads floats (4 (F + 3 K)), writes splats of 48 bytes and computes on fp32 lanes; a feature bank
// makes all of the first layer depend on the eye. Not counted: weights and cameras, which stay on chip.
//
// The floor holds for given counts: tighter culling lowers both. Blending stops early at a pixel that is opaque and finds
// splats of neighbouring tiles in the cache, so it may take less than the time for its bytes.
#pragma once

#include <gsc/renderer.h>

#include <cstdint>

namespace gsc {

// Cost of decoding an anchor, from the hyper-parameters.
struct AnchorCost {
    double bytes = 0;       // read per visible anchor, for both eyes
    double shared_macs = 0; // multiply-adds per visible anchor, for both eyes
    double eye_macs = 0;    // per visible anchor and eye
    double splat_bytes = 0; // written by decode and read by blend, per splat
    bool exact = false;     // tier exact: fp32 lanes instead of the matrix units
};

AnchorCost anchorCost(const ModelView& model, Tier tier);

// Least work of a stage: bytes and operations.
struct StageWork {
    double bytes_read = 0, bytes_written = 0;
    double lane_operations = 0; // fp32
    double exponentials = 0;
    double matrix_flop = 0;
};

struct FrameWork {
    StageWork select, decode, bin, sort, blend;
};

// Least work of each stage for one frame. `pixels`: of one eye. `sorts_apart`: sort is a stage, not a part of blend.
FrameWork leastWork(const AnchorCost& anchor, const EyeCounts* eyes, uint32_t eye_count, double pixels,
                    bool sorts_apart);

// Ceiling of a device that sets a floor.
enum class Bound { None, Memory, Lanes, Exponentials, Matrix };

const char* boundName(Bound bound); // name in schemas/run.schema.json

// Least time of a stage. All parts of a device can be busy at a time, so the slowest alone sets it.
struct StageFloor {
    double ms = 0;
    Bound bound = Bound::None; // the slowest part
};

// Floor of a stage. Bytes that are only read take the read ceiling, equal amounts of read and written bytes the copy ceiling,
// other mixtures a rate in between. Precondition: ceilings.known().
StageFloor floorOf(const StageWork& work, const DeviceCeilings& ceilings);

} // namespace gsc
