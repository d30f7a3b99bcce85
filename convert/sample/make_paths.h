// SPDX-License-Identifier: Apache-2.0
// `gsc sample paths`: camera paths for a .gsc file.
#pragma once

#include "convert/sample/model_paths.h"

#include <string>
#include <vector>

namespace gsc {

struct PathsOptions {
    std::string input;                    // a .gsc file
    std::string output;                   // folder of the NAME.json
    uint32_t width = 2048, height = 2048; // pixels
    double fov_x = 0.5 * kPi;             // radians
    double fps = kHeadsetRate;
    double ipd = 0; // world units, and with it the metre: 0.064 of one; 0 = the file's, else derived
    std::vector<std::string> only;
    bool overwrite = false;
};

struct PathsReport {
    CaptureKind capture{};
    size_t cameras = 0; // that see the model
    double metre = 0;   // world units
    std::string metre_rule;
    std::vector<ModelPath> paths;
};

// Same file and options, same bytes. Throws Error: Usage, Io, InvalidFile, Unsupported, Interrupted; then no file is
// changed unless the last renames failed.
PathsReport makePaths(const PathsOptions& options);

} // namespace gsc
