// SPDX-License-Identifier: Apache-2.0
// `gsc compare --render`: compares pictures of a file with pictures of the checkpoint that it was made from.
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
    // folder with the trainer's pictures and their cameras.json; empty = searched in the model folder
    std::string golden;
    std::string cameras; // path of a camera file; empty = the cameras stored in the .gsc
    // draw `cameras` as if they had no lens distortion; false: refuse those that have
    bool ignore_distortion = false;
    // how to use the applied_transform that the file `cameras` states
    CamerasTransform cameras_transform = CamerasTransform::Told;
    uint64_t views = 3;   // number of stored cameras to draw, evenly spaced; 0 = all
    double min_psnr = 75; // dB that every view must reach
    Tier tier = Tier::Exact;
    // Float: with the rounding of the trainers' arithmetic; Double: nearly without rounding
    ReferencePrecision reference = ReferencePrecision::Float;
    LpipsFiles lpips;
    int threads = 0;
};

struct RenderComparison {
    Tier tier = Tier::Exact; // tier that the pictures of the file were drawn in
    // pictures of the file by the fast CPU path, compared with those of a newly converted file by the scalar reference
    PictureSet reference;
    PictureSet trainer; // pictures of the file, compared with the trainer's own; empty if there are none of those
    std::string lpips_missing; // why a view has no LPIPS score; empty = every view has one

    [[nodiscard]] bool passes(double min_psnr) const;
};

// Draws and compares the pictures. Throws Error; leaves no temporary file.
RenderComparison compareRenders(const Checkpoint& checkpoint, const std::string& file, const RenderOptions& options,
                                Reporter& report);

} // namespace gsc
