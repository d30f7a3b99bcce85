// SPDX-License-Identifier: Apache-2.0
// Writes pictures one behind the other as a stream of bytes for another program.
#pragma once

#include "runtime/image/image_io.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

enum class StreamFormat {
    Y4m,   // YUV4MPEG2, C444p16 at full range with BT.601's matrix: converting it back gives exactly the bytes of Rgb24
    Rgb24, // 8 bits per channel: red, green, blue; no header
    Rgb48, // 16 bits per channel: red, green, blue; low byte first; no header
};

// Function that writes the stream's bytes. Throws Error(Io), also if the reading program has ended.
using ByteSink = std::function<void(std::span<const std::byte>)>;

// Returns a sink that writes to standard output. Throws Error(Usage) if that is a terminal.
ByteSink standardOutputSink();

// Writes a frame rate as a fraction with `between` in the middle, "30000:1001". Television rates such as 29.97 become
// their exact fractions.
std::string rateText(double fps, char between);

// Writes pictures to a sink. Values are rounded as in image files (writeImage()).
class PictureStream {
public:
    // `width`, `height`: size of one eye's picture in pixels; two eyes lie side by side, the left one first. `fps` is
    // stated in a Y4M header.
    PictureStream(StreamFormat format, uint32_t width, uint32_t height, uint32_t eye_count, double fps, ByteSink sink);

    void add(std::span<const Image> eyes);

private:
    StreamFormat m_format;
    uint32_t m_width, m_height;
    ByteSink m_sink;
    std::vector<std::byte> m_frame;
};

} // namespace gsc
