// SPDX-License-Identifier: Apache-2.0
// Pictures one behind the other on standard output, for another program to read.
#pragma once

#include "format/file/output_file.h"
#include "player/image/image_io.h"

#include <span>
#include <vector>

namespace gsc {

enum class StreamFormat {
    Y4m,   // YUV4MPEG2, C444p16 at full range with BT.601's matrix: the bytes of Rgb24 can be had back from it exactly
    Rgb24, // 8 bits per channel, nothing else
    Rgb48, // 16 bits per channel, little end first
};

// Values round as those of image files do (writeImage()).
class PictureStream {
public:
    // width, height: of one eye; eyes lie side by side, the left one first. fps: stated in a Y4m. Throws Error(Usage) where
    // standard output is a terminal.
    PictureStream(StreamFormat format, uint32_t width, uint32_t height, uint32_t eye_count, double fps);

    // Throws Error(Io), also where the reader has gone.
    void add(std::span<const Image> eyes);

private:
    StreamFormat m_format;
    uint32_t m_width, m_height;
    OutputFile m_output;
    std::vector<std::byte> m_frame;
};

} // namespace gsc
