// SPDX-License-Identifier: Apache-2.0
#include "player/output/picture_stream.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include <unistd.h>

namespace gsc {

namespace {

void put16(std::byte* to, uint16_t value)
{
    to[0] = std::byte(value & 0xff);
    to[1] = std::byte(value >> 8);
}

// Converts one pixel from 8-bit RGB to 16-bit YUV by ITU-R BT.601's matrix at full range. An 8-bit value v becomes 257
// * v in 16 bits, so that converting back and rounding gives v again.
void putYuv(std::byte* y, std::byte* u, std::byte* v, const uint8_t* rgb)
{
    const double r = rgb[0], g = rgb[1], b = rgb[2], luma = 0.299 * r + 0.587 * g + 0.114 * b;
    const auto rounded = [](double value) { return uint16_t(std::lround(std::clamp(value, 0.0, 65535.0))); };
    put16(y, rounded(257 * luma));
    put16(u, rounded(32768 + 257 * (b - luma) / 1.772));
    put16(v, rounded(32768 + 257 * (r - luma) / 1.402));
}

size_t pixelBytes(StreamFormat format)
{
    return format == StreamFormat::Rgb24 ? 3 : 6;
}

void put(const ByteSink& sink, std::string_view text)
{
    sink(std::as_bytes(std::span(text)));
}

} // namespace

ByteSink standardOutputSink()
{
    if (::isatty(STDOUT_FILENO) != 0)
        throw Error(ErrorCode::Usage, "--out -", "standard output is a terminal",
                    "a program or a file to take the pictures", "put a pipe behind the command, such as | ffplay -");
    auto output = std::make_shared<OutputFile>("-", OutputKind::Text, false);
    return [output](std::span<const std::byte> bytes) { output->write(bytes); };
}

std::string rateText(double fps, char between)
{
    const double ntsc = fps * 1001 / 1000;
    if (std::abs(ntsc - std::round(ntsc)) < 1e-4 && std::abs(fps - std::round(fps)) > 1e-4)
        return std::to_string(std::lround(ntsc) * 1000) + between + "1001";
    return std::to_string(std::lround(fps * 1000)) + between + "1000";
}

PictureStream::PictureStream(StreamFormat format, uint32_t width, uint32_t height, uint32_t eye_count, double fps,
                             ByteSink sink)
    : m_format(format), m_width(width), m_height(height), m_sink(std::move(sink)),
      m_frame(size_t(width) * eye_count * height * pixelBytes(format))
{
    if (format == StreamFormat::Y4m)
        put(m_sink, formatString("YUV4MPEG2 W%u H%u F%s Ip A1:1 C444p16 XCOLORRANGE=FULL\n", width * eye_count, height,
                                 rateText(fps, ':').c_str()));
}

void PictureStream::add(std::span<const Image> eyes)
{
    const size_t row = size_t(m_width) * eyes.size(), plane = row * m_height;
    for (size_t eye = 0; eye < eyes.size(); ++eye)
        for (size_t y = 0; y < m_height; ++y)
            for (size_t x = 0; x < m_width; ++x) {
                const float* const pixel = eyes[eye].pixels.data() + (y * m_width + x) * 3;
                const size_t at = y * row + eye * m_width + x;
                const uint8_t bytes[3] = {wholeValue<uint8_t>(pixel[0]), wholeValue<uint8_t>(pixel[1]),
                                          wholeValue<uint8_t>(pixel[2])};
                for (size_t c = 0; c < 3 && m_format != StreamFormat::Y4m; ++c)
                    if (m_format == StreamFormat::Rgb24)
                        m_frame[3 * at + c] = std::byte(bytes[c]);
                    else
                        put16(m_frame.data() + 6 * at + 2 * c, wholeValue<uint16_t>(pixel[c]));
                if (m_format == StreamFormat::Y4m)
                    putYuv(m_frame.data() + 2 * at, m_frame.data() + 2 * (plane + at),
                           m_frame.data() + 2 * (2 * plane + at), bytes);
            }
    if (m_format == StreamFormat::Y4m)
        put(m_sink, "FRAME\n");
    m_sink(m_frame);
}

} // namespace gsc
