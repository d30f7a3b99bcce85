// SPDX-License-Identifier: Apache-2.0
// `gsc compare --render`: pictures of a file against pictures of the checkpoint it was made from.
#pragma once

#include "convert/input/checkpoint.h"
#include "player/tool/reporter.h"
#include "kernels/frame/frame_types.h"
#include "runtime/metrics/metrics.h"

#include <string>
#include <vector>

namespace gsc {

enum class ReferencePrecision { Float, Double };

struct RenderOptions {
    std::string golden;  // folder of the trainer's pictures and their cameras.json; empty = look in the model folder
    std::string cameras; // camera file; empty = the cameras stored in the .gsc
    bool ignore_distortion = false; // of the lenses in `cameras`, which is refused otherwise
    uint64_t views = 3;             // of the stored cameras, evenly spaced; 0 = all
    double min_psnr = 75;           // of every view, dB
    Tier tier = Tier::Exact;
    ReferencePrecision reference = ReferencePrecision::Float; // Float: the trainer's rounding; Double: no rounding
    int threads = 0;
};

struct RenderedView {
    std::string name;
    uint32_t width = 0, height = 0;
    uint32_t picture_bits = 0; // of the trainer's picture; 0 = compared with the reference
    ImageDifference difference;
    double ssim = 0, flip = 0;
};

struct PictureSet {
    std::vector<RenderedView> views;
    PooledDifference pool;

    void add(RenderedView view);
};

struct RenderComparison {
    Tier tier = Tier::Exact; // that the file was rendered in
    PictureSet reference;    // the file through the fast backend, against the scalar reference over a fresh bake
    PictureSet trainer;      // the same against the trainer's own pictures; empty if there are none

    [[nodiscard]] bool passes(double min_psnr) const;
};

// Throws Error; leaves no temporary file.
RenderComparison compareRenders(const Checkpoint& checkpoint, const std::string& file, const RenderOptions& options,
                                Reporter& report);

} // namespace gsc
