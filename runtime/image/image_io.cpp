// SPDX-License-Identifier: Apache-2.0
#include "runtime/image/image_io.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "format/file/path_ending.h"
#include "format/file/stand_in.h"
#include "format/machine/threads.h"
#include "runtime/image/oiio_image.h"
#include "runtime/image/png_file.h"
#include "runtime/module/load_module.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <span>
#include <string_view>

namespace gsc {

namespace {

// Extensions of images that this build can write, in lower case.
#ifdef GSC_WITH_OIIO
constexpr std::string_view kExtensions[] = {".pfm", ".png", ".exr", ".jpg", ".jpeg", ".webp"};
#else
constexpr std::string_view kExtensions[] = {".pfm", ".png"};
#endif

#ifdef GSC_WITH_OIIO
// Loads the module for OpenImageIO. If the system is short of threads, the module then starts none: OpenImageIO
// assumes that a thread can always be started.
const OiioImageFunctions& loadOiio()
{
    const bool are_short = threadsAreShort(0);
    if (are_short)
        for (const char* const pool : {"OPENIMAGEIO_THREADS", "OMP_NUM_THREADS"})
            ::setenv(pool, "1", 1);
    const auto& functions = loadModule<OiioImageFunctions>("gsc_image_oiio", kOiioThreads);
    if (are_short)
        functions.startNoThreads();
    return functions;
}
#endif

// Functions that read and write every kind of image but PNG and PFM. Throws Error(Unsupported) where the build has none.
const OiioImageFunctions& oiio([[maybe_unused]] const std::string& path)
{
#ifdef GSC_WITH_OIIO
    static const OiioImageFunctions& functions = loadOiio();
    return functions;
#else
    throw Error(ErrorCode::Unsupported, path, "this build cannot read this kind of image", ".png or .pfm",
                "use a build with GSC_WITH_OIIO");
#endif
}

std::ifstream opened(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(ErrorCode::Io, path, formatString("cannot be opened (%s)", std::strerror(errno)),
                    "an image that can be read", "check the path and its rights");
    char start[kStandInBytes];
    file.read(start, sizeof(start));
    const auto count = size_t(file.gcount());
    file.clear();
    file.seekg(0, std::ios::end);
    refuseStandIn(std::as_bytes(std::span(start, count)), uint64_t(std::max<std::streamoff>(file.tellg(), 0)), path);
    file.seekg(0);
    return file;
}

// Writes a portable float map: a text header, then rows from bottom to top, little-endian (scale -1).
void writePfm(OutputFile& file, const Image& image)
{
    static_assert(std::endian::native == std::endian::little);
    constexpr size_t kBlock = size_t(1) << 20; // rows are written in blocks of about this many bytes
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

Image readPfm(const std::string& path)
{
    std::ifstream file = opened(path);
    std::string magic;
    long width = 0, height = 0;
    double scale = 0;
    file >> std::setw(16) >> magic >> width >> height >> scale;
    file.get(); // exactly one whitespace character ends the header
    if (magic != "PF")
        throw Error(ErrorCode::InvalidFile, path, "no colour PFM image", "it to start with PF",
                    "convert it to a colour image");
    if (width < 1 || height < 1 || width > long(kMostImageSide) || height > long(kMostImageSide))
        throw Error(ErrorCode::InvalidFile, path, formatString("is %ld x %ld pixels", width, height),
                    formatString("1 to %u each", kMostImageSide), "pass another image");
    if (!std::isfinite(scale) || scale == 0)
        throw Error(ErrorCode::InvalidFile, path, formatString("has scale %g", scale), "-1 or 1",
                    "write the image again");
    Image image;
    image.width = uint32_t(width);
    image.height = uint32_t(height);
    const size_t row = size_t(width) * 3;
    // read row by row, so that a header with a wrong size costs no memory
    std::vector<float> bottom_up;
    for (long y = 0; y < height; ++y) {
        bottom_up.resize(bottom_up.size() + row);
        if (!file.read(reinterpret_cast<char*>(bottom_up.data() + size_t(y) * row),
                       std::streamsize(row * sizeof(float))))
            throw Error(ErrorCode::InvalidFile, path, formatString("ends in row %ld of %ld", y, height), "all of them",
                        "copy or write the image again");
    }
    if (scale > 0) // a positive scale means big-endian
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
    std::string list;
    for (const std::string_view extension : kExtensions)
        list.append(list.empty() ? "" : ", ").append(extension);
    return list;
}

bool isImageExtension(const std::string& path)
{
    return std::ranges::find(kExtensions, endingOf(path)) != std::end(kExtensions);
}

bool isLossyExtension(const std::string& path)
{
    constexpr std::string_view kLossy[] = {".jpg", ".jpeg", ".webp"};
    return std::ranges::find(kLossy, endingOf(path)) != std::end(kLossy);
}

bool hasOpenImageIo()
{
#ifdef GSC_WITH_OIIO
    return true;
#else
    return false;
#endif
}

void loadImageWriter(const std::string& path)
{
    if (const std::string extension = endingOf(path); extension != ".pfm" && extension != ".png")
        (void)oiio(path);
}

void writeImage(const std::string& path, const Image& image, PixelDepth depth, bool overwrite)
{
    if (!isImageExtension(path))
        throw Error(ErrorCode::Unsupported, path, "this build cannot write such a file", "one of " + imageExtensions(),
                    "choose one of them");
    const std::string extension = endingOf(path);
    std::vector<unsigned char> encoded;
    if (extension == ".png")
        encoded = encodePng(image, depth);
    else if (extension != ".pfm")
        encoded = oiio(path).encode(path, extension.substr(1), image);
    OutputFile file(path, OutputKind::Binary, overwrite);
    if (extension == ".pfm")
        writePfm(file, image);
    else
        file.write(std::as_bytes(std::span(encoded)));
    file.commit();
}

Image readImage(const std::string& path)
{
    if (endingOf(path) == ".pfm")
        return readPfm(path);
    std::ifstream file = opened(path);
    char start[kPngSignature.size()] = {};
    file.read(start, sizeof(start));
    const bool is_png = std::ranges::equal(std::as_bytes(std::span(start)), std::as_bytes(std::span(kPngSignature)));
    if (!is_png && (hasOpenImageIo() || endingOf(path) != ".png"))
        return oiio(path).read(path);
    file.clear();
    file.seekg(0);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    return decodePng(std::as_bytes(std::span(bytes)), path);
}

} // namespace gsc
