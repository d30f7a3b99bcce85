// SPDX-License-Identifier: Apache-2.0
#include "player/image/image_io.h"

#include "format/error.h"
#include "format/file/output_file.h"
#include "player/image/oiio_image.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

constexpr uint32_t kMaxSide = 32768; // pixels

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

[[noreturn]] void throwIo(const std::string& path, const char* what)
{
    throw Error(ErrorCode::Io,
                formatString("%s: %s (%s), expected an image that can be read; check the path and its rights",
                             path.c_str(), what, std::strerror(errno)));
}

std::string extensionOf(const std::string& path)
{
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return extension;
}

// Portable float map: text header, then rows bottom up, little-endian (scale -1).
void writePfm(OutputFile& file, const Image& image)
{
    static_assert(std::endian::native == std::endian::little);
    constexpr size_t kBlock = size_t(1) << 20; // bytes
    std::string block = formatString("PF\n%u %u\n-1.0\n", image.width, image.height);
    const size_t row = size_t(image.width) * 3;
    for (uint32_t y = image.height; y-- > 0;) {
        block.append(reinterpret_cast<const char*>(image.pixels.data() + y * row), row * sizeof(float));
        if (block.size() >= kBlock || y == 0) {
            file.write(block);
            block.clear();
        }
    }
}

// The next word of a PFM header, at most 15 characters.
std::string headerWord(std::FILE* file)
{
    std::string word;
    int c = std::fgetc(file);
    while (c == ' ' || c == '\n' || c == '\r' || c == '\t')
        c = std::fgetc(file);
    for (; c != EOF && !std::isspace(c) && word.size() < 16; c = std::fgetc(file))
        word += char(c); // the one whitespace that ends the word is consumed, as the format wants
    return word;
}

Image readPfm(const std::string& path)
{
    File file(std::fopen(path.c_str(), "rb"), std::fclose);
    if (!file)
        throwIo(path, "cannot be opened");
    const std::string magic = headerWord(file.get());
    if (magic != "PF")
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: no colour PFM image, expected it to start with PF; convert it to a colour image",
                                 path.c_str()));
    const long width = std::strtol(headerWord(file.get()).c_str(), nullptr, 10);
    const long height = std::strtol(headerWord(file.get()).c_str(), nullptr, 10);
    const double scale = std::strtod(headerWord(file.get()).c_str(), nullptr);
    if (width < 1 || height < 1 || width > long(kMaxSide) || height > long(kMaxSide))
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: is %ld x %ld pixels, expected 1 to %u each; pass another image", path.c_str(),
                                 width, height, kMaxSide));
    if (!std::isfinite(scale) || scale == 0)
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: has scale %g, expected -1 or 1; write the image again", path.c_str(), scale));
    Image image;
    image.width = uint32_t(width);
    image.height = uint32_t(height);
    const size_t row = size_t(width) * 3;
    // row by row, so that a header that lies about the size costs no memory
    std::vector<float> bottom_up;
    for (long y = 0; y < height; ++y) {
        bottom_up.resize(bottom_up.size() + row);
        if (std::fread(bottom_up.data() + size_t(y) * row, sizeof(float), row, file.get()) != row)
            throw Error(ErrorCode::InvalidFile,
                        formatString("%s: ends in row %ld of %ld, expected all of them; copy or write the image again",
                                     path.c_str(), y, height));
    }
    if (scale > 0) // big-endian
        for (float& value : bottom_up)
            value = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<uint32_t>(value)));
    image.pixels.reserve(bottom_up.size());
    for (long y = height; y-- > 0;) {
        const auto from = bottom_up.begin() + ptrdiff_t(size_t(y) * row);
        image.pixels.insert(image.pixels.end(), from, from + ptrdiff_t(row));
    }
    return image;
}

} // namespace

std::string imageExtensions()
{
    std::string list = ".pfm";
    for (const std::string& extension : oiioExtensions())
        list += ", " + extension;
    return list;
}

bool isImageExtension(const std::string& path)
{
    const std::string extension = extensionOf(path);
    const std::vector<std::string> known = oiioExtensions();
    return extension == ".pfm" || std::find(known.begin(), known.end(), extension) != known.end();
}

void loadImageWriter(const std::string& path)
{
    if (extensionOf(path) != ".pfm")
        loadOiio();
}

void writeImage(const std::string& path, const Image& image, PixelDepth depth, bool overwrite)
{
    if (!isImageExtension(path))
        throw Error(ErrorCode::Unsupported,
                    formatString("%s: this build cannot write such a file, expected one of %s; choose one of them",
                                 path.c_str(), imageExtensions().c_str()));
    OutputFile file(path, OutputKind::Binary, overwrite);
    const std::string extension = extensionOf(path);
    if (extension == ".pfm") {
        writePfm(file, image);
    } else {
        const std::vector<unsigned char> bytes = encodeOiioImage(path, extension, image, depth);
        file.write(std::as_bytes(std::span(bytes)));
    }
    file.commit();
}

Image readImage(const std::string& path)
{
    if (extensionOf(path) == ".pfm")
        return readPfm(path);
    const File file(std::fopen(path.c_str(), "rb"), std::fclose);
    if (!file)
        throwIo(path, "cannot be opened");
    return readOiioImage(path);
}

} // namespace gsc
