// SPDX-License-Identifier: Apache-2.0
// Outputs of a run: pictures and numbers.
#pragma once

#include "player/output/picture_stream.h"

#include <string>

namespace gsc {

struct OutputChoice {
    std::string out; // pattern, empty = write nothing, "-" = a stream on standard output
    PixelDepth depth = PixelDepth::Eight;
    StreamFormat stream = StreamFormat::Y4m; // format of --out -
    std::string video;                       // file, empty = none
    double fps = 30;                         // frames per second of a Y4M stream and of a video
    std::string stats;                       // file, empty = none
    bool overwrite = false;
};

} // namespace gsc
