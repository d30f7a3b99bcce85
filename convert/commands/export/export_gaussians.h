// SPDX-License-Identifier: Apache-2.0
// `gsc export --to ply|spz|glb|sog [--lod]` and `--html`: exports explicit Gaussians and measures their loss.
#pragma once

#include "convert/export/gaussian_files.h"
#include "runtime/cameras/camera_reading.h"
#include "runtime/cli/json.h"
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Gaussians of a model with levels that are exported together.
struct LevelSet {
    float share = 0;                                        // least share of the views of an anchor that draw its level
    uint16_t finest = std::numeric_limits<uint16_t>::max(); // index in the file of the finest level
};

struct LevelTrial {
    LevelSet choice;
    double psnr; // pooled over the trial's pictures, dB
};

enum class LevelRequest { Measured, All, UpTo };

struct GaussianExportOptions {
    std::string file; // path of a .gsc file
    std::string name; // name of the file in messages; empty = its path
    std::string output;
    GaussianFileFormat to = GaussianFileFormat::Ply;
    int spz_version = 3;                 // version of the SPZ format, 3 or 4
    uint64_t spz_most = kSpzReadersTake; // a warning is given for more Gaussians than this
    bool lod = false;                    // write a folder of levels and chunks, each of which is a SOG
    bool page = false;                   // write a page that contains the SOG
    std::string cameras;                 // path of a camera file; empty = the cameras stored in the file
    bool ignore_distortion = false;      // take cameras as if they had no lens distortion
    CamerasTransform cameras_transform = CamerasTransform::Told;
    // name or number of the camera whose view is exported; empty = fit over all cameras
    std::string at;
    int degree = kMostShDegree;
    uint64_t most = std::numeric_limits<uint64_t>::max(); // most Gaussians in the file
    uint64_t memory_budget = 0;                           // most bytes of memory for Gaussians; 0 = half of main memory
    LevelRequest levels = LevelRequest::Measured;
    int finest = 0; // number of the finest level, with UpTo
    int threads = 0;
    bool overwrite = false;
};

// pictures of an export that keep less than this, in dB against `exact`, are warned of
constexpr double kPoorPsnr = 25;

// How much pictures of the exported Gaussians differ from those of tier `exact`.
struct GaussianLoss {
    uint64_t cameras = 0;
    // PSNR in dB of all pictures pooled and of the worst picture; mean SSIM
    double psnr = 0, worst_psnr = 0, ssim = 0;
    std::string worst; // name of the camera with the worst picture
};

// One level of detail, which shows the whole model.
struct LodExport {
    uint64_t gaussians = 0, chunks = 0;
    std::optional<GaussianLoss> loss; // measured with this level alone
};

struct GaussianExport {
    // Gaussians in the file; Gaussians fitted; Gaussians of the levels that were chosen, of which the best were kept
    uint64_t gaussians = 0, fitted = 0, eligible = 0;
    int degree = 0;
    uint64_t bytes = 0, fit_cameras = 0;
    // false if the Gaussians did not all fit in memory, so that no loss was measured
    bool whole = true;
    // none if `whole` is false, or if the fit used every camera
    std::optional<GaussianLoss> loss;
    std::vector<LevelTrial> trials; // choices of levels that were measured; empty if there was nothing to choose
    LevelSet levels;                // choice that was exported
    std::vector<int> level_numbers; // the trainer's number of each level in the file, coarsest first
    std::vector<LodExport> lods;    // with `lod`: one entry per level, finest first

    // number of the finest level of a choice
    [[nodiscard]] int finestOf(const LevelSet& choice) const
    {
        return level_numbers[std::min<size_t>(choice.finest, level_numbers.size() - 1)];
    }
};

// JSON of the section `gaussians` of the report.
OrderedJson gaussiansJson(const GaussianExport& result);

// Exports the Gaussians. Throws Error; then no output and no temporary file is left.
GaussianExport exportGaussians(const GaussianExportOptions& options, Reporter& report);

} // namespace gsc
