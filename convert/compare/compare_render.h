// SPDX-License-Identifier: Apache-2.0
// `gsc compare --render`: pictures of a file against pictures of the checkpoint it was made from.
#pragma once

#include "convert/compare/picture_set.h"
#include "convert/input/checkpoint.h"
#include "runtime/cameras/camera_reading.h"
#include "runtime/cli/reporter.h"
#include <gsc/frame_types.h>

#include <string>

namespace gsc {

enum class ReferencePrecision { Float, Double };

struct RenderOptions {
    std::string golden;  // folder of the trainer's pictures and their cameras.json; empty = look in the model folder
    std::string cameras; // camera file; empty = the cameras stored in the .gsc
    bool ignore_distortion = false; // draw `cameras` as if they had no lens distortion; else such are refused
    CamerasTransform cameras_transform = CamerasTransform::Told; // how applied_transform in `cameras` is taken
    uint64_t views = 3;                                          // stored cameras to draw, evenly spaced; 0 = all
    double min_psnr = 75;                                        // least PSNR of every view, dB
    Tier tier = Tier::Exact;
    ReferencePrecision reference = ReferencePrecision::Float; // Float: the trainer's rounding; Double: no rounding
    LpipsFiles lpips;
    int threads = 0;
};

struct RenderComparison {
    Tier tier = Tier::Exact;   // tier that rendered the file
    PictureSet reference;      // the file through the fast backend, against the scalar reference over a fresh file
    PictureSet trainer;        // scores against the trainer's own pictures; empty if there are none
    std::string lpips_missing; // why a view has no LPIPS; empty = every view has it

    [[nodiscard]] bool passes(double min_psnr) const;
};

// Throws Error; leaves no temporary file.
RenderComparison compareRenders(const Checkpoint& checkpoint, const std::string& file, const RenderOptions& options,
                                Reporter& report);

} // namespace gsc
