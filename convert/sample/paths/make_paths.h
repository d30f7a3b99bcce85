// SPDX-License-Identifier: Apache-2.0
// `gsc sample paths`: camera paths for a .gsc file.
#pragma once

#include "convert/sample/paths/model_paths.h"
#include "runtime/cameras/length.h"

#include <string>
#include <vector>

namespace gsc {

struct PathsOptions {
    std::string input;                    // a .gsc file
    std::string output;                   // folder of the NAME.json
    uint32_t width = 2048, height = 2048; // pixels
    double fov_x = 0.5 * kPi;             // radians
    double fps = 0;                       // as in modelPaths()
    // Distance of the eyes. In world units it sets the metre, of which it is kEyesApart; else the metre is the file's,
    // or derived.
    Length ipd;
    std::vector<std::string> only;
    bool overwrite = false;
};

struct PathsReport {
    CaptureKind capture{};
    size_t cameras = 0; // cameras that see the model
    double metre = 0;   // world units
    std::string metre_rule;
    std::vector<ModelPath> paths;
};

// Same file and options, same bytes. Throws Error: Usage, Io, InvalidFile, Unsupported, Interrupted; then no file is
// changed unless the last renames failed.
PathsReport makePaths(const PathsOptions& options);

} // namespace gsc
