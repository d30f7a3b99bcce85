// SPDX-License-Identifier: Apache-2.0
// Writes a video through the program ffmpeg, which is looked for only if a video is wanted.
#pragma once

#include "player/output/picture_stream.h"

#include <memory>
#include <span>
#include <string>

namespace gsc {

// A video that browsers play: H.264 in an MP4, nearly lossless (CRF 10), BT.709, 4:2:0. Its width and height must be
// even: the last row or column is repeated where they are odd.
class VideoFile {
public:
    // `width`, `height`: size of one eye's picture in pixels; two eyes lie side by side. Throws Error: Unsupported if
    // there is no ffmpeg; Io.
    VideoFile(const std::string& path, uint32_t width, uint32_t height, uint32_t eye_count, double fps, bool overwrite);
    ~VideoFile(); // deletes the unfinished file if commit() was not called
    VideoFile(const VideoFile&) = delete;
    VideoFile& operator=(const VideoFile&) = delete;

    // add() and commit() throw Error(Io) with ffmpeg's message.
    void add(std::span<const Image> eyes);
    void commit(); // waits for ffmpeg; the file appears under its name only then

private:
    struct Encoder;
    std::unique_ptr<Encoder> m_encoder;
    uint32_t m_width = 0, m_height = 0; // size of one eye's picture in the video, pixels
    bool m_padded = false;
};

// Throws Error(Unsupported) if ffmpeg is not in PATH; `option` asked for it.
void checkVideoProgram(const std::string& option = "--video");

} // namespace gsc
