// SPDX-License-Identifier: Apache-2.0
#include "runtime/image/png_file.h"

#include <gsc/error.h>

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

namespace gsc {

namespace {

using Bytes = std::vector<uint8_t>;

constexpr uint32_t kMostChunk = 0x7fffffff;          // bytes
constexpr int kLevel = 1;                            // libdeflate's: more costs time and gives little on filtered rows
constexpr uint64_t kMostRatio = 1032;                // deflate's: a header that lies about the size costs no memory
constexpr uint8_t kRgb = 2, kPalette = 3, kRgba = 6; // colour types; 0 and 4 are grey
constexpr uint8_t kSub = 1;                          // filter: less the pixel to the left

void putNumber(Bytes& out, uint32_t value)
{
    for (int shift = 24; shift >= 0; shift -= 8)
        out.push_back(uint8_t(value >> shift));
}

uint32_t numberAt(std::span<const uint8_t> bytes)
{
    return uint32_t(bytes[0]) << 24 | uint32_t(bytes[1]) << 16 | uint32_t(bytes[2]) << 8 | bytes[3];
}

void putChunk(Bytes& out, const char* type, std::span<const uint8_t> data)
{
    putNumber(out, uint32_t(data.size()));
    const size_t start = out.size();
    out.insert(out.end(), type, type + 4);
    out.insert(out.end(), data.begin(), data.end());
    putNumber(out, libdeflate_crc32(0, out.data() + start, out.size() - start));
}

int paeth(int left, int up, int corner)
{
    const int to_left = std::abs(up - corner), to_up = std::abs(left - corner),
              to_corner = std::abs(left + up - 2 * corner);
    return to_left <= to_up && to_left <= to_corner ? left : to_up <= to_corner ? up : corner;
}

// Filters a row in every way but the plain one, and takes the one whose bytes, as signed numbers, sum up least: PNG's own
// advice for pictures. `row` and `above` have `pixel` zeros before them.
class RowFilter {
public:
    RowFilter(size_t bytes, size_t pixel) : m_pixel(pixel)
    {
        for (Bytes& bytes_of : m_filtered)
            bytes_of.resize(bytes);
    }

    void filter(const uint8_t* row, const uint8_t* above, uint8_t* to)
    {
        const size_t count = m_filtered[0].size(), pixel = m_pixel;
        const auto each = [&](Bytes& out, auto predicted) {
            uint8_t* const bytes = out.data();
            uint32_t sum = 0;
            for (size_t i = 0; i < count; ++i) {
                const auto byte = uint8_t(row[i] - predicted(i));
                bytes[i] = byte;
                sum += uint32_t(std::abs(int(int8_t(byte))));
            }
            return sum;
        };
        const uint8_t *const left = row - pixel, *const corner = above - pixel;
        const uint32_t sums[] = {each(m_filtered[0], [&](size_t i) { return left[i]; }),
                                 each(m_filtered[1], [&](size_t i) { return above[i]; }),
                                 each(m_filtered[2], [&](size_t i) { return (left[i] + above[i]) / 2; }),
                                 each(m_filtered[3], [&](size_t i) { return paeth(left[i], above[i], corner[i]); })};
        const size_t best = size_t(std::ranges::min_element(sums) - std::begin(sums));
        to[0] = uint8_t(kSub + best);
        std::memcpy(to + 1, m_filtered[best].data(), count);
    }

private:
    size_t m_pixel;
    Bytes m_filtered[4]; // kSub and those behind it
};

// Rows with the byte of their filter before them; samples of two bytes have the high one first.
template <typename Sample>
Bytes filteredRows(const Image& image)
{
    const size_t samples = size_t(image.width) * 3, row_bytes = samples * sizeof(Sample);
    constexpr size_t kPixel = 3 * sizeof(Sample);
    Bytes out(image.height * (row_bytes + 1)), row(kPixel + row_bytes), above(kPixel + row_bytes);
    RowFilter filter(row_bytes, kPixel);
    std::vector<Sample> values(samples);
    for (size_t y = 0; y < image.height; ++y) {
        const float* const from = image.pixels.data() + y * samples;
        std::transform(from, from + samples, values.begin(), wholeValue<Sample>);
        if constexpr (sizeof(Sample) == 2)
            std::ranges::transform(values, values.begin(), [](Sample v) { return Sample(v << 8 | v >> 8); });
        std::memcpy(row.data() + kPixel, values.data(), row_bytes);
        filter.filter(row.data() + kPixel, above.data() + kPixel, out.data() + y * (row_bytes + 1));
        row.swap(above);
    }
    return out;
}

// The parts of a file that a picture is made of.
struct PngParts {
    uint32_t width = 0, height = 0;
    uint8_t depth = 0, color = 0; // bits of a sample, colour type
    bool interlaced = false;
    Bytes palette;    // red, green, blue of each entry
    Bytes compressed; // all IDAT chunks, joined

    [[nodiscard]] uint32_t pixelBits() const { return depth * (color == kPalette ? 1u : color == kRgb ? 3u : 4u); }
};

class PngReader {
public:
    PngReader(std::span<const uint8_t> file, const std::string& path) : m_file(file), m_path(path) {}

    PngParts parts()
    {
        if (m_file.size() < kPngSignature.size() ||
            !std::ranges::equal(m_file.first(kPngSignature.size()), kPngSignature))
            throw Error(ErrorCode::InvalidFile, m_path, "no PNG image", "it to start with PNG's signature",
                        "check the path and the file");
        m_file = m_file.subspan(kPngSignature.size());
        readHeader(chunk("IHDR"));
        for (;;) {
            std::string type;
            const std::span<const uint8_t> data = chunk(nullptr, &type);
            if (type == "IDAT")
                m_parts.compressed.insert(m_parts.compressed.end(), data.begin(), data.end());
            else if (type == "PLTE")
                m_parts.palette.assign(data.begin(), data.end());
            else if (type == "IEND")
                break;
            else if ((type[0] & 0x20) == 0)
                fail("has a chunk " + type + " that a reader must know");
        }
        if (m_parts.color == kPalette && (m_parts.palette.empty() || m_parts.palette.size() % 3 != 0))
            fail("has no palette");
        return std::move(m_parts);
    }

    [[noreturn]] void fail(const std::string& reason) const
    {
        throw Error(ErrorCode::InvalidFile, m_path, "cannot be decoded (" + reason + ")", "a whole image",
                    "copy or write it again");
    }

private:
    // Returns the next chunk's data; `expected`: its type, null = any, which is then in `type`.
    std::span<const uint8_t> chunk(const char* expected, std::string* type = nullptr)
    {
        if (m_file.size() < 12)
            fail("it ends early");
        const uint32_t length = numberAt(m_file);
        if (length > kMostChunk || length > m_file.size() - 12)
            fail("it ends early");
        const std::string name(reinterpret_cast<const char*>(m_file.data()) + 4, 4);
        if (numberAt(m_file.subspan(8 + length)) != libdeflate_crc32(0, m_file.data() + 4, 4 + length))
            fail("the checksum of chunk " + printable(name) + " is wrong");
        if (expected != nullptr && name != expected)
            fail("it begins with chunk " + printable(name));
        if (type != nullptr)
            *type = name;
        const std::span<const uint8_t> data = m_file.subspan(8, length);
        m_file = m_file.subspan(12 + length);
        return data;
    }

    static std::string printable(std::string name)
    {
        std::ranges::replace_if(
            name, [](char c) { return c < ' ' || c > '~'; }, '?');
        return name;
    }

    void readHeader(std::span<const uint8_t> data)
    {
        if (data.size() != 13)
            fail("its header has " + std::to_string(data.size()) + " bytes");
        m_parts.width = numberAt(data);
        m_parts.height = numberAt(data.subspan(4));
        m_parts.depth = data[8];
        m_parts.color = data[9];
        m_parts.interlaced = data[12] == 1;
        if (m_parts.width < 1 || m_parts.height < 1 || m_parts.width > kMostImageSide ||
            m_parts.height > kMostImageSide)
            throw Error(ErrorCode::InvalidFile, m_path,
                        formatString("is %u x %u pixels", m_parts.width, m_parts.height),
                        formatString("1 to %u each", kMostImageSide), "pass another image");
        if (m_parts.color == 0 || m_parts.color == 4)
            throw Error(ErrorCode::Unsupported, m_path, "is grey", "red, green and blue",
                        "convert it to a colour image");
        const uint8_t depth = m_parts.depth;
        const bool fits = m_parts.color == kPalette ? depth == 1 || depth == 2 || depth == 4 || depth == 8
                                                    : depth == 8 || depth == 16;
        if ((m_parts.color != kRgb && m_parts.color != kPalette && m_parts.color != kRgba) || !fits || data[10] != 0 ||
            data[11] != 0 || data[12] > 1)
            fail("its header has values that PNG does not know");
    }

    std::span<const uint8_t> m_file;
    const std::string& m_path;
    PngParts m_parts;
};

// Every pixel of a picture that is not interlaced, or those of one of Adam7's passes.
struct Pass {
    uint32_t x = 0, y = 0, step_x = 1, step_y = 1;
};
constexpr Pass kPasses[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                            {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};

struct PassSize {
    uint32_t width = 0, height = 0;
    size_t row_bytes = 0;
};

PassSize sizeOf(const PngParts& parts, const Pass& pass)
{
    const auto count = [](uint32_t all, uint32_t first, uint32_t step) {
        return all > first ? (all - first - 1) / step + 1 : 0;
    };
    PassSize size{count(parts.width, pass.x, pass.step_x), count(parts.height, pass.y, pass.step_y)};
    size.row_bytes = (uint64_t(size.width) * parts.pixelBits() + 7) / 8;
    return size;
}

// Undoes the filter of `row`; `above`: the row before it, zeros for the first. Returns false for a filter there is none of.
bool unfilter(uint8_t filter, std::span<uint8_t> row, std::span<const uint8_t> above, size_t pixel)
{
    const size_t count = row.size();
    const auto left = [&](size_t i) { return i >= pixel ? row[i - pixel] : uint8_t(0); };
    switch (filter) {
    case 0:
        return true;
    case kSub:
        for (size_t i = pixel; i < count; ++i)
            row[i] = uint8_t(row[i] + row[i - pixel]);
        return true;
    case 2:
        for (size_t i = 0; i < count; ++i)
            row[i] = uint8_t(row[i] + above[i]);
        return true;
    case 3:
        for (size_t i = 0; i < count; ++i)
            row[i] = uint8_t(row[i] + (left(i) + above[i]) / 2);
        return true;
    case 4:
        for (size_t i = 0; i < count; ++i)
            row[i] = uint8_t(row[i] + paeth(left(i), above[i], i >= pixel ? above[i - pixel] : 0));
        return true;
    default:
        return false;
    }
}

class PngDecoder {
public:
    PngDecoder(const PngParts& parts, const PngReader& reader) : m_parts(parts), m_reader(reader)
    {
        m_image.width = parts.width;
        m_image.height = parts.height;
    }

    Image image()
    {
        const std::span<const Pass> passes =
            m_parts.interlaced ? std::span<const Pass>(kPasses) : std::span<const Pass>(&kWhole, 1);
        uint64_t bytes = 0;
        for (const Pass& pass : passes)
            if (const PassSize size = sizeOf(m_parts, pass); size.width > 0)
                bytes += size.height * (uint64_t(size.row_bytes) + 1);
        if (bytes > (m_parts.compressed.size() + 64) * kMostRatio)
            m_reader.fail("its pixels are missing");
        Bytes raw(bytes);
        const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflate(
            libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
        if (!inflate)
            throw std::bad_alloc();
        if (libdeflate_zlib_decompress(inflate.get(), m_parts.compressed.data(), m_parts.compressed.size(), raw.data(),
                                       raw.size(), nullptr) != LIBDEFLATE_SUCCESS)
            m_reader.fail("its pixels are damaged or of another number");
        m_image.pixels.resize(size_t(m_parts.width) * m_parts.height * 3);
        std::span<uint8_t> rest = raw;
        for (const Pass& pass : passes)
            takePass(pass, rest);
        return std::move(m_image);
    }

private:
    static constexpr Pass kWhole{};

    void takePass(const Pass& pass, std::span<uint8_t>& rest)
    {
        const PassSize size = sizeOf(m_parts, pass);
        if (size.width == 0)
            return;
        const size_t pixel = std::max<size_t>(1, m_parts.pixelBits() / 8);
        Bytes zeros(size.row_bytes);
        std::span<const uint8_t> above = zeros;
        for (uint32_t y = 0; y < size.height; ++y) {
            const std::span<uint8_t> row = rest.subspan(1, size.row_bytes);
            if (!unfilter(rest[0], row, above, pixel))
                m_reader.fail("a row has a filter that PNG does not know");
            for (uint32_t x = 0; x < size.width; ++x)
                put(row, x, pass.x + x * pass.step_x, pass.y + y * pass.step_y);
            above = row;
            rest = rest.subspan(1 + size.row_bytes);
        }
    }

    // Pixel x of a row, at its place in the picture.
    void put(std::span<const uint8_t> row, uint32_t x, uint32_t to_x, uint32_t to_y)
    {
        float* const to = m_image.pixels.data() + 3 * (size_t(to_y) * m_parts.width + to_x);
        if (m_parts.color == kPalette) {
            const uint32_t bit = x * m_parts.depth;
            const uint32_t index = row[bit / 8] >> (8 - m_parts.depth - bit % 8) & ((1u << m_parts.depth) - 1);
            if (3 * index >= m_parts.palette.size())
                m_reader.fail("a pixel has a colour that the palette lacks");
            for (size_t c = 0; c < 3; ++c)
                to[c] = float(m_parts.palette[3 * index + c]) / 255;
            return;
        }
        const size_t channels = m_parts.color == kRgb ? 3 : 4;
        for (size_t c = 0; c < 3; ++c) {
            const size_t sample = x * channels + c;
            to[c] = m_parts.depth == 8 ? float(row[sample]) / 255
                                       : float(row[2 * sample] << 8 | row[2 * sample + 1]) / 65535;
        }
    }

    const PngParts& m_parts;
    const PngReader& m_reader;
    Image m_image;
};

} // namespace

std::vector<unsigned char> encodePng(const Image& image, PixelDepth depth)
{
    const Bytes rows = depth == PixelDepth::Eight ? filteredRows<uint8_t>(image) : filteredRows<uint16_t>(image);
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> deflate(
        libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
    if (!deflate)
        throw std::bad_alloc();
    Bytes compressed(libdeflate_zlib_compress_bound(deflate.get(), rows.size()));
    compressed.resize(
        libdeflate_zlib_compress(deflate.get(), rows.data(), rows.size(), compressed.data(), compressed.size()));

    Bytes header, out(kPngSignature.begin(), kPngSignature.end());
    putNumber(header, image.width);
    putNumber(header, image.height);
    header.insert(header.end(), {uint8_t(depth == PixelDepth::Eight ? 8 : 16), kRgb, 0, 0, 0});
    putChunk(out, "IHDR", header);
    for (size_t at = 0; at < compressed.size(); at += kMostChunk)
        putChunk(out, "IDAT", std::span(compressed).subspan(at, std::min<size_t>(kMostChunk, compressed.size() - at)));
    putChunk(out, "IEND", {});
    return out;
}

Image decodePng(std::span<const std::byte> file, const std::string& path)
{
    PngReader reader({reinterpret_cast<const uint8_t*>(file.data()), file.size()}, path);
    const PngParts parts = reader.parts();
    return PngDecoder(parts, reader).image();
}

} // namespace gsc
