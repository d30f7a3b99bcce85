// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/image/image_io.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <utility>

#include <sys/resource.h>
#include <unistd.h>

using namespace gsc;
using namespace gsc::test;
namespace fs = std::filesystem;

namespace {

struct TempFolder {
    fs::path path = fs::temp_directory_path() / ("gsc_image_" + std::to_string(getpid()));
    TempFolder() { fs::create_directories(path); }
    ~TempFolder() { fs::remove_all(path); }
    [[nodiscard]] std::string operator/(const char* name) const { return (path / name).string(); }
};

Image someImage(uint32_t width, uint32_t height)
{
    std::mt19937 random(5);
    Image image{width, height, {}};
    for (size_t i = 0; i < size_t(width) * height * 3; ++i)
        image.pixels.push_back(float(double(random()) / 4294967296.0 * 1.4 - 0.2)); // beyond [0, 1] on both sides
    return image;
}

ErrorCode codeOf(const std::string& path)
{
    return outcomeOf([&] { (void)readImage(path); }).code;
}

void writeText(const std::string& path, const std::string& text)
{
    std::ofstream(path, std::ios::binary) << text;
}

std::string readText(const std::string& path)
{
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

bool canWrite(const char* name)
{
    return isImageExtension(name);
}

} // namespace

TEST_CASE("PFM keeps every bit, NaN and infinity included")
{
    const TempFolder folder;
    Image image = someImage(7, 5);
    image.pixels[0] = std::numeric_limits<float>::infinity();
    image.pixels[1] = std::numeric_limits<float>::quiet_NaN();
    writeImage(folder / "a.pfm", image, PixelDepth::Eight, true);
    const Image back = readImage(folder / "a.pfm");
    CHECK(back.width == 7);
    CHECK(back.height == 5);
    REQUIRE(back.pixels.size() == image.pixels.size());
    CHECK(std::memcmp(back.pixels.data(), image.pixels.data(), image.pixels.size() * 4) == 0);
    const std::string text = readText(folder / "a.pfm");
    CHECK(text.substr(0, 12) == "PF\n7 5\n-1.0\n");
    // rows are stored bottom up
    CHECK(std::memcmp(text.data() + 12, image.pixels.data() + size_t(4) * 21, 84) == 0);
    // and nothing else is left in the folder
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);
}

TEST_CASE("PFM files as wide or as high as may be")
{
    const TempFolder folder;
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{32768, 1}, {1, 32768}}) {
        writeImage(folder / "a.pfm", someImage(width, height), PixelDepth::Eight, true);
        CHECK(readImage(folder / "a.pfm").width == width);
        CHECK(readImage(folder / "a.pfm").pixels.size() == size_t(3) * 32768);
    }
}

TEST_CASE("hostile PFM files are refused")
{
    const TempFolder folder;
    const std::string path = folder / "a.pfm";
    for (const char* text :
         {"", "PF", "Pf\n1 1\n-1\n1234", "PF\n1 1\n-1\n", "PF\n1 1\n0\n123456789012", "PF\n1 1\nnan\n123456789012",
          "PF\n99999999999999999999 1\n-1\n", "PF\n-1 1\n-1\n", "PF\n30000 30000\n-1\nshort", "P6\n1 1\n255\nabc"}) {
        writeText(path, text);
        CAPTURE(text);
        CHECK(codeOf(path) == ErrorCode::InvalidFile);
    }
    CHECK(codeOf(folder / "none.pfm") == ErrorCode::Io);
    CHECK(codeOf(folder / "none.png") == ErrorCode::Io);
    // big-endian
    writeText(path, std::string("PF\n1 1\n1.0\n") + std::string("\x3f\x80\0\0\x40\0\0\0\0\0\0\0", 12));
    const Image image = readImage(path);
    CHECK(image.pixels == std::vector<float>{1, 2, 0});
}

TEST_CASE("a file that stands for an image is named as what it is")
{
    const TempFolder folder;
    const std::pair<std::string, const char*> texts[] = {
        {"version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 12\n", "is a Git LFS pointer"},
        {"<!DOCTYPE html><html></html>", "is a web page"},
        {std::string("\x1f\x8b\x08\0\0\0\0\0\0\3", 10), "is compressed with gzip"}};
    for (const char* name : {"a.pfm", "a.png", "a.exr", "a.jpg", "a"})
        for (const auto& [text, said] : texts) {
            writeText(folder / name, text);
            const Outcome refused = outcomeOf([&] { (void)readImage(folder / name); });
            CHECK_MESSAGE(refused.says(said), refused.message);
        }
}

TEST_CASE("an extension without a writer is refused, naming those there are")
{
    const Outcome refused = outcomeOf([&] { writeImage("x.gif", someImage(1, 1), PixelDepth::Eight, true); });
    CHECK(refused.code == ErrorCode::Unsupported);
    CHECK(refused.says(".pfm"));
}

TEST_CASE("a folder that is not there is an I/O error and leaves nothing")
{
    const TempFolder folder;
    for (const char* name : {"none/a.pfm", "none/a.png", "none/a.exr", "none/a.jpg", "none/a.webp"}) {
        if (!canWrite(name))
            continue;
        CAPTURE(name);
        const Outcome refused = outcomeOf([&] { writeImage(folder / name, someImage(3, 3), PixelDepth::Eight, true); });
        CHECK(refused.code == ErrorCode::Io);
    }
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("a full disk is an I/O error")
{
    const TempFolder folder;
    rlimit before{};
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    for (const char* name : {"a.pfm", "a.png", "a.exr", "a.jpg", "a.webp"}) {
        if (!canWrite(name))
            continue;
        CAPTURE(name);
        const rlimit limit{100, before.rlim_max};
        REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
        ErrorCode code = ErrorCode::Ok;
        try {
            writeImage(folder / name, someImage(64, 64), PixelDepth::Eight, true);
        } catch (const Error& e) {
            code = e.code();
        }
        REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
        CHECK(code == ErrorCode::Io);
    }
    std::signal(SIGXFSZ, handler);
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("PNG follows torchvision's rounding in both depths")
{
    const TempFolder folder;
    Image image = someImage(33, 17);
    image.pixels[0] = std::numeric_limits<float>::quiet_NaN();
    image.pixels[1] = 0.5f / 255; // a half rounds up
    for (const auto& [depth, max] : {std::pair{PixelDepth::Eight, 255.0f}, std::pair{PixelDepth::Sixteen, 65535.0f}}) {
        writeImage(folder / "a.png", image, depth, true);
        const std::string first = readText(folder / "a.png");
        writeImage(folder / "a.png", image, depth, true);
        CHECK(readText(folder / "a.png") == first); // the same bytes again
        const Image back = readImage(folder / "a.png");
        REQUIRE(back.pixels.size() == image.pixels.size());
        for (size_t i = 1; i < image.pixels.size(); ++i) {
            const float clamped = std::fmin(std::fmax(max * image.pixels[i] + 0.5f, 0.0f), max);
            CHECK(back.pixels[i] == std::trunc(clamped) / max);
        }
        CHECK(back.pixels[0] == 0);
    }
}

TEST_CASE("JPEG and WebP lose little, and are the same bytes again")
{
    if (!canWrite("a.jpg")) {
        MESSAGE("skipped: built without OpenImageIO");
        return;
    }
    const TempFolder folder;
    Image image{64, 48, {}};
    for (size_t i = 0; i < size_t(64) * 48; ++i) // a smooth picture with values beyond [0, 1]
        for (const float value : {float(i % 64) / 60 - 0.01f, float(i / 64) / 47, 0.25f})
            image.pixels.push_back(value);
    for (const char* name : {"a.jpg", "a.JPEG", "a.webp"}) {
        CAPTURE(name);
        writeImage(folder / name, image, PixelDepth::Eight, true);
        const std::string first = readText(folder / name);
        writeImage(folder / name, image, PixelDepth::Eight, true);
        CHECK(readText(folder / name) == first);
        const Image back = readImage(folder / name);
        REQUIRE(back.pixels.size() == image.pixels.size());
        double squares = 0;
        for (size_t i = 0; i < image.pixels.size(); ++i)
            squares += std::pow(back.pixels[i] - std::fmin(std::fmax(image.pixels[i], 0.0f), 1.0f), 2);
        CHECK(std::sqrt(squares / double(image.pixels.size())) < 0.01); // 40 dB
    }
    const Outcome large =
        outcomeOf([&] { writeImage(folder / "b.webp", someImage(16384, 1), PixelDepth::Eight, true); });
    CHECK(large.code == ErrorCode::Unsupported);
    CHECK(large.says("16383"));
    writeImage(folder / "b.jpg", someImage(16384, 1), PixelDepth::Eight, true);
    CHECK_FALSE(fs::exists(folder / "b.webp"));
}

TEST_CASE("an image is known by its content, whatever its extension")
{
    const TempFolder folder;
    writeImage(folder / "a.png", someImage(5, 4), PixelDepth::Eight, true);
    for (const char* name : {"b.jpg", "b.exr", "b"}) {
        fs::copy_file(folder / "a.png", folder / name);
        CHECK(readImage(folder / name).pixels == readImage(folder / "a.png").pixels);
    }
    if (!hasOpenImageIo())
        return;
    for (const char* name : {"a.jpg", "a.webp", "a.exr"}) {
        writeImage(folder / name, someImage(5, 4), PixelDepth::Eight, true);
        fs::copy_file(folder / name, folder / "c.png", fs::copy_options::overwrite_existing);
        CHECK(readImage(folder / "c.png").pixels == readImage(folder / name).pixels);
    }
}

TEST_CASE("EXR keeps 32-bit floats")
{
    if (!canWrite("a.exr")) {
        MESSAGE("skipped: built without OpenImageIO");
        return;
    }
    const TempFolder folder;
    const Image image = someImage(33, 17);
    writeImage(folder / "a.EXR", image, PixelDepth::Eight, true);
    const Image back = readImage(folder / "a.EXR");
    REQUIRE(back.pixels.size() == image.pixels.size());
    CHECK(std::memcmp(back.pixels.data(), image.pixels.data(), image.pixels.size() * 4) == 0);
    CHECK(readText(folder / "a.EXR").find("1970:01:01") != std::string::npos); // no clock in the file
}

TEST_CASE("damaged PNG files are refused at every length and with every byte changed")
{
    const TempFolder folder;
    writeImage(folder / "a.png", someImage(16, 16), PixelDepth::Eight, true);
    const std::string good = readText(folder / "a.png");
    for (size_t size = 0; size < good.size(); size += 7) {
        writeText(folder / "b.png", good.substr(0, size));
        CHECK(codeOf(folder / "b.png") == ErrorCode::InvalidFile);
    }
    for (size_t at = 0; at < good.size(); at += 3) { // each chunk has a checksum
        std::string bad = good;
        bad[at] = char(bad[at] ^ 4);
        writeText(folder / "b.png", bad);
        CHECK(codeOf(folder / "b.png") == ErrorCode::InvalidFile);
    }
}

TEST_CASE("a PNG header that lies about the size costs no memory")
{
    const TempFolder folder;
    writeImage(folder / "a.png", someImage(1, 1), PixelDepth::Eight, true);
    std::string lie = readText(folder / "a.png");
    const std::string header("IHDR\0\0\x80\0\0\0\x80\0\x10\2\0\0\0\x1b\x8e\xe8\x6b", 21); // 32768 x 32768, 16 bits
    lie.replace(12, header.size(), header);
    writeText(folder / "b.png", lie);
    try {
        (void)readImage(folder / "b.png");
        FAIL("it was read");
    } catch (const Error& e) {
        CHECK(std::string(e.what()).find("its pixels are missing") != std::string::npos);
    }
}
