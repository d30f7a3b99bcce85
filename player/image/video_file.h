// SPDX-License-Identifier: Apache-2.0
// A video through the program ffmpeg, which is asked for only when one is wanted.
#pragma once

#include "player/image/picture_stream.h"

#include <memory>
#include <span>
#include <string>

namespace gsc {

// H.264 in an MP4: nearly lossless (CRF 10), BT.709, 4:2:0, or 4:4:4 where a side of the picture is odd.
class VideoFile {
public:
    // width, height: of one eye; eyes lie side by side. Throws Error: Unsupported (there is no ffmpeg), Io.
    VideoFile(const std::string& path, uint32_t width, uint32_t height, uint32_t eye_count, double fps, bool overwrite);
    ~VideoFile(); // without commit() nothing is left
    VideoFile(const VideoFile&) = delete;
    VideoFile& operator=(const VideoFile&) = delete;

    // Both throw Error(Io) with what ffmpeg says.
    void add(std::span<const Image> eyes);
    void commit(); // waits for ffmpeg, then the file appears

private:
    struct Encoder;
    std::unique_ptr<Encoder> m_encoder;
};

// Throws Error(Unsupported) where there is no ffmpeg to run.
void checkVideoProgram();

} // namespace gsc
