// SPDX-License-Identifier: Apache-2.0
// A video through the program ffmpeg, which is asked for only when one is wanted.
#pragma once

#include "player/output/picture_stream.h"

#include <memory>
#include <span>
#include <string>

namespace gsc {

// H.264 in an MP4 as browsers play it: nearly lossless (CRF 10), BT.709, 4:2:0. That needs even sides: an odd one gets one
// more row or column, which repeats the last.
class VideoFile {
public:
    // width, height: of one eye; eyes lie side by side. Throws Error: Unsupported (there is no ffmpeg), Io.
    VideoFile(const std::string& path, uint32_t width, uint32_t height, uint32_t eye_count, double fps, bool overwrite);
    ~VideoFile(); // without commit() nothing is left
    VideoFile(const VideoFile&) = delete;
    VideoFile& operator=(const VideoFile&) = delete;

    // Both throw Error(Io) with ffmpeg's message.
    void add(std::span<const Image> eyes);
    void commit(); // waits for ffmpeg, then the file appears

private:
    struct Encoder;
    std::unique_ptr<Encoder> m_encoder;
    uint32_t m_width = 0, m_height = 0; // size of one eye, as written
    bool m_padded = false;
};

// Throws Error(Unsupported) if there is no ffmpeg to run.
void checkVideoProgram();

} // namespace gsc
