// SPDX-License-Identifier: Apache-2.0
// Pictures one behind the other, for another program to read.
#pragma once

#include "runtime/image/image_io.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

enum class StreamFormat {
    Y4m,   // YUV4MPEG2, C444p16 at full range with BT.601's matrix: the bytes of Rgb24 can be had back from it exactly
    Rgb24, // 8 bits per channel, nothing else
    Rgb48, // 16 bits per channel, little end first
};

// Function that takes the stream's bytes. Throws Error(Io), also if the reader has gone.
using ByteSink = std::function<void(std::span<const std::byte>)>;

// Throws Error(Usage) where standard output is a terminal.
ByteSink standardOutputSink();

// Pictures of a second as a fraction, "30000:1001"; rates of television exactly.
std::string rateText(double fps, char between);

// Values round as those of image files do (writeImage()).
class PictureStream {
public:
    // width, height: of one eye; eyes lie side by side, the left one first. fps: stated in a Y4m.
    PictureStream(StreamFormat format, uint32_t width, uint32_t height, uint32_t eye_count, double fps, ByteSink sink);

    void add(std::span<const Image> eyes);

private:
    StreamFormat m_format;
    uint32_t m_width, m_height;
    ByteSink m_sink;
    std::vector<std::byte> m_frame;
};

} // namespace gsc
