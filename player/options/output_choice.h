// SPDX-License-Identifier: Apache-2.0
// Output files of a run: pictures and measured numbers.
#pragma once

#include "player/output/picture_stream.h"

#include <string>

namespace gsc {

struct OutputChoice {
    std::string out; // pattern of the pictures' paths; empty = write none; "-" = a stream on standard output
    PixelDepth depth = PixelDepth::Eight;
    StreamFormat stream = StreamFormat::Y4m; // format of the stream that --out - writes
    std::string video;                       // path of a video; empty = none
    std::string video_option = "--video";    // option that named it, for messages
    std::string stats;                       // path of the file of numbers, a line for each frame; empty = none
    bool overwrite = false;

    [[nodiscard]] bool writes() const { return !out.empty() || !video.empty() || !stats.empty(); }
};

} // namespace gsc
