// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cli/options.h"

#include <CLI/CLI.hpp>
#include <doctest/doctest.h>

#include <limits>

using namespace gsc;

namespace {

struct Values {
    double angle = 0;
    float bound = 0;
    int64_t whole = 0;
    uint64_t bytes = 0, count = 0;
    uint32_t width = 0, height = 0;
};

// The message, empty if the value was taken.
std::string take(const char* option, const char* text, Values& values)
{
    CLI::App app;
    addNumber(app, "-a,--angle", values.angle, {0, 90, true}, " degrees", "DEGREES", "");
    addNumber(app, "--bound", values.bound, {0, 255}, "", "B", "");
    addInteger(app, "--whole", values.whole, -3, std::numeric_limits<int64_t>::max(), "N", "");
    addByteSize(app, "--bytes", values.bytes, 1, "SIZE", "");
    addCount(app, "--count", values.count, 2, 1000000, "N", "");
    addImageSize(app, "--size", values.width, values.height, "WxH", "");
    const char* argv[] = {"prog", option, text};
    try {
        app.parse(3, argv);
        return "";
    } catch (const Error& e) {
        CHECK(e.code() == ErrorCode::Usage);
        const std::string message = e.what();
        CHECK(message.rfind(std::string(option), 0) == 0);
        CHECK(message.find(", expected ") != std::string::npos);
        CHECK(message.find("; ") != std::string::npos);
        return message;
    }
}

} // namespace

TEST_CASE("values within their range are taken")
{
    Values v;
    CHECK(take("--angle", "45.5", v).empty());
    CHECK(v.angle == 45.5);
    CHECK(take("--bound", "255", v).empty());
    CHECK(v.bound == 255);
    CHECK(take("--whole", "-3", v).empty());
    CHECK(v.whole == -3);
    CHECK(take("--whole", "9223372036854775807", v).empty());
    CHECK(take("--bytes", "1.5 GiB", v).empty());
    CHECK(v.bytes == uint64_t(3) << 29);
    CHECK(take("--count", "20k", v).empty());
    CHECK(v.count == 20000);
    CHECK(take("--size", "32768x1", v).empty());
    CHECK(v.width == 32768);
}

TEST_CASE("values out of range or of another kind are refused with their range")
{
    Values v;
    for (const char* text : {"0", "90", "-1", "nan", "inf", "1e999", "4 5", "45x", "0x10", "1,5", "+3", ""})
        CHECK_MESSAGE(!take("--angle", text, v).empty(), text);
    CHECK(take("--angle", "90", v).find("more than 0 and less than 90 degrees") != std::string::npos);
    for (const char* text : {"-4", "1.0", "9223372036854775808", "1e3", "many", "--3"})
        CHECK_MESSAGE(!take("--whole", text, v).empty(), text);
    for (const char* text : {"0", "-1", "1e9", "99999999999T", "much"})
        CHECK_MESSAGE(!take("--bytes", text, v).empty(), text);
    for (const char* text : {"1", "1000001", "2M", "1.5", "-2"})
        CHECK_MESSAGE(!take("--count", text, v).empty(), text);
    for (const char* text : {"5x", "5kk", "k", "many"})
        CHECK_MESSAGE(take("--count", text, v).find("no whole number") != std::string::npos, text);
    for (const char* text : {"0x1", "1x32769", "640", "axb", "640x480x3", " 1x1"})
        CHECK_MESSAGE(!take("--size", text, v).empty(), text);
}
