// SPDX-License-Identifier: Apache-2.0
// `gsc export --to ply|spz|glb|sog [--lod]` and `--html`: explicit Gaussians, and their loss.
#pragma once

#include "convert/export/gaussian_files.h"
#include "runtime/cameras/camera_reading.h"
#include "runtime/cli/json.h"
#include "runtime/cli/reporter.h"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct GaussianExportOptions {
    std::string file, output;
    GaussianFileFormat to = GaussianFileFormat::Ply;
    int spz_version = 3;                 // 3 or 4
    uint64_t spz_most = kSpzReadersTake; // more are written with a warning
    bool lod = false;                    // a folder of levels and chunks, each of them Sog
    bool page = false;                   // a page that holds the file, which is Sog
    std::string cameras;                 // file, empty = those stored
    bool ignore_distortion = false;      // take cameras as if they had no lens distortion
    CamerasTransform cameras_transform = CamerasTransform::Told;
    std::string at; // name or number of the camera whose view is exported; empty = fit over all
    int degree = kMostShDegree;
    uint64_t most = std::numeric_limits<uint64_t>::max(); // Gaussians
    uint64_t memory_budget = 0;                           // bytes that Gaussians may take; 0 = half of memory
    int threads = 0;
    bool overwrite = false;
};

// Difference of the exported file's pictures from those of tier `exact`.
struct GaussianLoss {
    uint64_t cameras = 0;
    double psnr = 0, worst_psnr = 0, ssim = 0; // dB, pooled and of the worst; mean
    std::string worst;                         // camera
};

// A level of detail, which stands for the whole.
struct LodExport {
    uint64_t gaussians = 0, chunks = 0;
    std::optional<GaussianLoss> loss; // loss of pictures of this level alone
};

struct GaussianExport {
    uint64_t gaussians = 0, fitted = 0; // Gaussians in the file; Gaussians fitted, before the best were chosen
    int degree = 0;
    uint64_t bytes = 0, fit_cameras = 0;
    bool whole = true;                // false: they did not all fit in memory, so no loss was measured
    std::optional<GaussianLoss> loss; // none unless `whole`, nor where no camera is left that the fit did not use
    std::vector<LodExport> lods;      // the finest first; with `lod`
};

// Section `gaussians` of the report.
OrderedJson gaussiansJson(const GaussianExport& result);

// Throws Error; leaves nothing behind.
GaussianExport exportGaussians(const GaussianExportOptions& options, Reporter& report);

} // namespace gsc
