// SPDX-License-Identifier: Apache-2.0
// `gsc sample paths`: makes camera paths for a .gsc file.
#pragma once

#include "convert/sample/paths/model_paths.h"
#include "runtime/cameras/length.h"

#include <string>
#include <vector>

namespace gsc {

struct PathsOptions {
    std::string input;                    // path of a .gsc file
    std::string output;                   // folder in which NAME.json is written for each path
    uint32_t width = 2048, height = 2048; // size of the pictures in pixels
    double fov_x = 0.5 * kPi;             // horizontal angle of view in radians
    double fps = 0;                       // frames per second; 0 = each path's own, see modelPaths()
    // Distance of the eyes. If it is in world units, it also sets the metre, of which it is kEyesApart. Otherwise the
    // metre is that of the file, or derived from the model.
    Length ipd;
    std::vector<std::string> only;
    bool overwrite = false;
};

struct PathsReport {
    CaptureKind capture{};
    size_t cameras = 0; // number of cameras that see the model
    double metre = 0;   // world units to a metre of the viewer's body
    std::string metre_rule;
    std::vector<ModelPath> paths;
};

// Makes and writes the paths. Equal file and options give equal bytes. Throws Error: Usage, Io, InvalidFile,
// Unsupported, Interrupted. Then no file has changed, unless renaming the finished files failed.
PathsReport makePaths(const PathsOptions& options);

} // namespace gsc
