// SPDX-License-Identifier: Apache-2.0
// Mapping, checksum, bounds-checked bytes, the arithmetic of the layout header.
#include "tests/format/mutation.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/outcome.h"

#include <gsc/byte_view.h>
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/utf8.h>
#include "format/validate/gsc_validate.h"
#include <gsc/half.h>
#include <gsc/file/mapped_file.h>
#include <gsc/file/output_paths.h>

#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include <sys/stat.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("an error says its message in UTF-8 without control characters")
{
    CHECK(validUtf8("a\xff\xc3\xa9\xe2\x82 \x1b[31m\n\t") == "a\xef\xbf\xbd\xc3\xa9\xef\xbf\xbd\xef\xbf\xbd ?[31m\n\t");
    const Error error(ErrorCode::Io, "\x80.gsc", "gone", "a file", "check it");
    CHECK(error.subject() == "\xef\xbf\xbd.gsc");
    CHECK(std::string(error.what()) == "\xef\xbf\xbd.gsc: gone, expected a file; check it");
}

TEST_CASE("an error has four parts and names settings")
{
    const Error error =
        Error(ErrorCode::Io, "a/b", "gone (why, so)", "a file; or two", "check it").with({Setting::Overwrite});
    CHECK(error.code() == ErrorCode::Io);
    CHECK(error.found() == "gone (why, so)");
    CHECK(error.expected() == "a file; or two");
    CHECK(error.remedy() == "check it");
    const Error other = error.about("c");
    CHECK(other.code() == ErrorCode::Io);
    CHECK(other.settings() == std::vector<Setting>{Setting::Overwrite});
    CHECK(std::string(other.what()) == "c: gone (why, so), expected a file; or two; check it");
    CHECK(other.what() == "c: " + other.withoutSubject());
    const Error bug = internalError("display", "a picture is nowhere", "it inside");
    CHECK(bug.code() == ErrorCode::Internal);
    CHECK(std::string(bug.what()) ==
          "display: a picture is nowhere, expected it inside; this is a bug, please report it");
}

TEST_CASE("MappedFile maps what is there and refuses what is no file")
{
    const TemporaryFolder dir;
    std::ofstream(dir / "empty");
    CHECK(MappedFile(dir / "empty").bytes().empty());
    std::ofstream(dir / "five") << "12345";
    MappedFile five(dir / "five");
    REQUIRE(five.bytes().size() == 5);
    CHECK(five.bytes()[4] == std::byte('5'));
    const MappedFile moved = std::move(five);
    CHECK(moved.bytes().size() == 5);
    CHECK(five.bytes().empty());
    REQUIRE(::mkfifo((dir / "pipe").c_str(), 0600) == 0);
    for (const std::string& path : {dir / "absent", dir.path().string(), dir / "pipe"}) {
        CAPTURE(path);
        const Outcome refused = outcomeOf([&] { const MappedFile file(path); });
        CHECK(refused.code == ErrorCode::Io);
        CHECK(refused.message.find(path) == 0);
    }
}

TEST_CASE("checksum64 is XXH3-64, in one piece or many")
{
    // published test vectors of XXH3-64 with seed 0
    CHECK(checksum64({}) == 0x2d06800538d394c2);
    std::vector<std::byte> bytes(5000);
    std::mt19937 random(3);
    for (std::byte& b : bytes)
        b = std::byte(random());
    const uint64_t whole = checksum64(bytes);
    for (const size_t step : {size_t(1), size_t(7), size_t(256), size_t(4999)}) {
        Checksum64 sum;
        for (size_t at = 0; at < bytes.size(); at += step)
            sum.update(std::span(bytes).subspan(at, std::min(step, bytes.size() - at)));
        CHECK(sum.digest() == whole);
        CHECK(sum.digest() == whole);
    }
    bytes[2500] ^= std::byte{1};
    CHECK(checksum64(bytes) != whole);
}

TEST_CASE("ByteView never lets an offset or a count wrap")
{
    alignas(8) const std::byte data[64] = {};
    const ByteView view{std::span(data)};
    CHECK(view.contains(64, 0));
    CHECK(!view.contains(65, 0));
    CHECK(!view.contains(~0ull, 1));
    CHECK(!view.contains(1, ~0ull));
    CHECK(view.load<uint64_t>(56).has_value());
    CHECK(!view.load<uint64_t>(57).has_value());
    CHECK(view.array<uint32_t>(60, 1).has_value());
    CHECK(!view.array<uint32_t>(60, 2).has_value());
    CHECK(!view.array<uint32_t>(62, 0).has_value()); // misaligned
    CHECK(!view.array<uint64_t>(0, 1ull << 61).has_value());
    CHECK(!view.array<uint64_t>(0, ~0ull).has_value());
    CHECK(view.slice(10, 54)->size() == 54);
    CHECK(!view.slice(10, 55).has_value());
}

TEST_CASE("chunkArrayLayout leaves every array aligned and none overlapping")
{
    for (const uint32_t anchors : {1u, 2u, 127u, 128u, 10'001u, 0xfffffffeu}) {
        ModelParams params{};
        params.feat_dim = kMaxFeatDim;
        params.n_offsets = kMaxOffsets;
        params.flags = kModelHasLevels | kModelHasRotation | kModelHasOpacity | kModelHasNormal;
        const ChunkArrayLayout layout = chunkArrayLayout(params, anchors);
        uint64_t end = 0;
        for (uint32_t i = 0; i < uint32_t(ChunkArray::Count); ++i) {
            CHECK(layout.offset[i] % kArrayAlign == 0);
            CHECK(layout.offset[i] >= end);
            CHECK(layout.offset[i] < end + kArrayAlign);
            end = layout.offset[i] + layout.stride[i] * anchors;
        }
        CHECK(layout.bytes == end);
    }
}

TEST_CASE("gridCoordinate rounds twice, as the trainer does")
{
    const float quantum = 0.01783736f, origin = -57.88737869262695f;
    uint32_t differs = 0;
    for (int32_t k = 295; k < 7742; ++k) {
        const float product = float(k) * quantum;
        volatile float rounded = product;
        CHECK(gridCoordinate(k, quantum, origin, false) == rounded + origin);
        differs += std::fma(float(k), quantum, origin) != rounded + origin;
    }
    CHECK(differs > 4000); // a fused multiply-add, which rounds once, would be noticed
    CHECK(std::bit_cast<uint32_t>(gridCoordinate(0, 1.0f, 0.0f, true)) == 0x80000000u);
    CHECK(std::bit_cast<uint32_t>(gridCoordinate(0, 1.0f, 0.0f, false)) == 0u);
}

TEST_CASE("floatToHalfUp gives the smallest half that is not below")
{
    for (uint32_t bits = 0; bits <= kMaxHalfBits; ++bits) {
        const float value = halfToFloat(uint16_t(bits));
        bool good = floatToHalfUp(value) == bits;
        if (bits < kMaxHalfBits) {
            const float next = halfToFloat(uint16_t(bits + 1));
            good = good && value < next && floatToHalfUp(std::nextafter(value, next)) == bits + 1 &&
                   floatToHalfUp((value + next) / 2) == bits + 1 &&
                   floatToHalfUp(std::nextafter(next, value)) == bits + 1;
        }
        if (!good)
            CHECK_MESSAGE(false, "half ", bits);
    }
    CHECK(halfToFloat(0x3c00) == 1);
    CHECK(halfToFloat(0xc400) == -4);
    CHECK(halfToFloat(0x0001) == std::ldexp(1.0f, -24));
    CHECK(halfToFloat(kMaxHalfBits) == 65504);
    CHECK(floatToHalfUp(65504.01f) == kMaxHalfBits);
    CHECK(floatToHalfUp(INFINITY) == kMaxHalfBits);
    CHECK(floatToHalfUp(NAN) == kMaxHalfBits);
    CHECK(floatToHalfUp(-0.0f) == 0);
    CHECK(floatToHalfUp(-3) == 0);
    CHECK(floatToHalfUp(std::numeric_limits<float>::denorm_min()) == 1);
}

TEST_CASE("mortonLess is the order of interleaved bits, x lowest")
{
    const auto key = [](const int32_t(&c)[3]) {
        uint64_t out = 0;
        for (int bit = 20; bit >= 0; --bit)
            for (int axis = 2; axis >= 0; --axis)
                out = out << 1 | (uint32_t(c[axis] + (1 << 20)) >> bit & 1u);
        return out;
    };
    std::mt19937 random(5);
    for (int i = 0; i < 20'000; ++i) {
        int32_t a[3], b[3];
        for (int axis = 0; axis < 3; ++axis) {
            const uint32_t span = 1u << random() % 20;
            a[axis] = int32_t(random() % span) - int32_t(span / 2);
            b[axis] = random() % 3 == 0 ? a[axis] : int32_t(random() % span) - int32_t(span / 2);
        }
        CHECK(validate::mortonLess(a, b) == (key(a) < key(b)));
        CHECK(!validate::mortonLess(a, a));
    }
}

TEST_CASE("utf8Prefix stops at the first byte that is not UTF-8")
{
    using namespace std::string_view_literals;
    for (const std::string_view good : {""sv, "ascii\n"sv, "\xc3\xa9"sv, "\xe2\x82\xac"sv, "\xf0\x9f\x98\x80"sv,
                                        "\xed\x9f\xbf"sv, "\xf4\x8f\xbf\xbf"sv})
        CHECK(utf8Prefix(good) == good.size());
    for (const std::string_view bad :
         {"\x80"sv, "\xc0\x80"sv, "\xc1\xbf"sv, "\xe0\x9f\xbf"sv, "\xed\xa0\x80"sv, "\xf0\x8f\xbf\xbf"sv,
          "\xf4\x90\x80\x80"sv, "\xf5\x80\x80\x80"sv, "\xe2\x82"sv, "\xe2\x28\xa1"sv, "\xff"sv}) {
        CHECK(utf8Prefix(bad) == 0);
        CHECK(utf8Prefix("ok" + std::string(bad)) == 2);
    }
}

TEST_CASE("an output that is an input or another output is refused, under any name")
{
    const TemporaryFolder dir;
    std::ofstream(dir / "model") << "1";
    std::filesystem::create_symlink("model", dir / "symbolic");
    std::filesystem::create_hard_link(dir / "model", dir / "hard");
    std::filesystem::create_directory(dir / "folder");
    const std::vector<NamedPath> inputs = {{dir / "model", "the model"}, {dir / "folder", "the folder"}};
    const auto codeFor = [&](const std::vector<NamedPath>& outputs) {
        return outcomeOf([&] { checkOutputsDiffer(outputs, inputs); }).code;
    };
    CHECK(codeFor({{dir / "a", "--out"}, {dir / "b", "--stats"}}) == ErrorCode::Ok);
    CHECK(codeFor({}) == ErrorCode::Ok);
    for (const char* name : {"model", "./model", "folder/../model", "absent/../model", "symbolic", "hard", "folder/"})
        CHECK_MESSAGE(codeFor({{dir / name, "--out"}}) == ErrorCode::Usage, name);
    CHECK(codeFor({{dir / "a", "--out"}, {dir / "folder/../a", "--stats"}}) == ErrorCode::Usage);
    std::filesystem::create_symlink("b", dir / "dangling"); // both names would make one file
    CHECK(codeFor({{dir / "b", "--out"}, {dir / "dangling", "--stats"}}) == ErrorCode::Usage);
    CHECK(codeFor({{"-", "--out"}}) == ErrorCode::Ok);
    CHECK(codeFor({{dir / "new/a", "--out"}, {dir / "new/./a", "--stats"}}) == ErrorCode::Usage);
}

TEST_CASE("decodedText takes byte order marks off and leaves what is no text as it is")
{
    const auto utf16 = [](const std::u16string& text, bool big_endian) {
        std::string bytes;
        for (const char16_t unit : text) {
            bytes += char(big_endian ? unit >> 8 : unit & 0xff);
            bytes += char(big_endian ? unit & 0xff : unit >> 8);
        }
        return bytes;
    };
    CHECK(decodedText("").empty());
    CHECK(decodedText("a") == "a");
    CHECK(decodedText("\xef\xbb\xbf").empty());
    CHECK(decodedText("\xef\xbb\xbf{}") == "{}");
    CHECK(decodedText("a\xef\xbb\xbf") == "a\xef\xbb\xbf");
    for (const bool big_endian : {false, true}) {
        CHECK(decodedText(utf16(u"\ufeffa", big_endian)) == "a");
        CHECK(decodedText(utf16(u"\ufeff{\"caf\u00e9 \u20ac \U0001f600\":1}\r\n", big_endian)) ==
              "{\"caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80\":1}\r\n");
        CHECK(decodedText(utf16({0xfeff, 'a', 0xd800, 'b', 0xdc00}, big_endian)) == "a\xef\xbf\xbd"
                                                                                    "b\xef\xbf\xbd");
    }
    // COLMAP's count of 130,815 cameras, whose first has the number 1
    const std::string binary("\xff\xfe\1\0\0\0\0\0\1\0\0\0", 12), printable("\xff\xfe\x41\0\0\0\0\0\1\0\0\0", 12);
    CHECK(decodedText(binary) == binary);
    CHECK(decodedText(printable) == printable);
}
