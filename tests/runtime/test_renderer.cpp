// SPDX-License-Identifier: Apache-2.0
// The renderer interface on the host: tickets, targets, what a frame thread throws.
#include "kernels/blend/blend.h"
#include "kernels/present/pixel.h"
#include "runtime/cpu/frame_thread.h"
#include "runtime/devices/device_fallback.h"
#include "runtime/devices/graphics_card.h"
#include "tests/backends/reuse_scene.h"
#include "tests/support/temporary_folder.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <semaphore>

using namespace gsc;
using namespace gsc::test;

namespace {

using namespace std::chrono_literals;

FrameRequest oneEye(const EyeParams& eye, const FrameTarget& target)
{
    return {{&eye, 1}, {&target, 1}, FrameOptions{}};
}

} // namespace

TEST_CASE("a target has the picture in its format and its rows, and nothing else of it changes")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto renderer = open(model.view());
    const std::vector<EyeParams> eyes = walk(0, 1);
    const uint32_t width = eyes[0].width, height = eyes[0].height;
    const std::vector<float> plain = render(*renderer, eyes, FrameOptions{})[0].pixels;
    for (const PixelFormat format :
         {PixelFormat::Rgb32f, PixelFormat::Rgba16f, PixelFormat::Rgba8, PixelFormat::Bgra8}) {
        const size_t pixel = pixelBytes(format), pitch = width * pixel + 24;
        std::vector<uint64_t> memory(pitch * height / 8, 0x5a5a5a5a5a5a5a5aull); // as aligned as any target
        std::vector<float> depths((width + 3) * height, -7.0f);
        render(*renderer, oneEye(eyes[0], {FrameTarget::Kind::Host, format, memory.data(), pitch, 0, depths.data(),
                                           (width + 3) * sizeof(float), 0}));
        for (uint32_t i = 0; i < depths.size(); ++i)
            REQUIRE((depths[i] == -7) == (i % (width + 3) >= width));
        const std::vector<unsigned char> wanted = inTarget(plain, width, format, pitch, 0x5a);
        CHECK(std::memcmp(memory.data(), wanted.data(), wanted.size()) == 0);
    }
}

TEST_CASE("a depth is that of the splat behind which less than half of the light goes on")
{
    // opacities of three splats in the middle of a pixel, from near to far, and which has its depth
    for (const auto& [first, second, third, wanted] : {std::tuple{0.6f, 0.9f, 0.9f, 1.0f},
                                                       {0.5f, 0.5f, 0.5f, 2.0f}, // half is not less than half
                                                       {0.3f, 0.3f, 0.3f, 2.0f},
                                                       {0.1f, 0.2f, 0.4f, 3.0f},
                                                       {0.1f, 0.2f, 0.3f, INFINITY}}) {
        std::vector<SplatOf<float>> splats;
        for (const float opacity : {first, second, third})
            splats.push_back({0, 0, {1, 0, 1}, opacity, {1, 1, 1}, float(splats.size() + 1), {}, splats.size()});
        float depths[2] = {-7, -7}, image[3], black[3] = {};
        RasterConstants rules{};
        rules.alpha_cap = 0.99f;
        rules.stop = 1e-4f;
        blendReference<float>(splats, {{0, 3}, {0, 1, 2}}, 1, 1, rules, black, image, {depths, 2});
        CHECK(depths[0] == wanted);
        CHECK(depths[1] == -7);
    }
}

TEST_CASE("colours as bytes and halves: rounding, limits, what is no number")
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (const auto& [value, byte] : {std::pair{0.0f, 0},
                                      {-1.0f, 0},
                                      {nan, 0},
                                      {1.0f, 255},
                                      {7.0f, 255},
                                      {inf, 255},
                                      {-inf, 0},
                                      {0.5f, 128},
                                      {0.49f / 255, 0},
                                      {0.51f / 255, 1},
                                      {254.6f / 255, 255}})
        CHECK(pixelByte(value) == byte);
    for (uint32_t bits = 0; bits < 0x7c00; ++bits) { // every finite half, and what lies between it and the next
        const float value = halfToFloat(uint16_t(bits)),
                    next = bits < 0x7bff ? halfToFloat(uint16_t(bits + 1)) : 65536.0f;
        const float middle = value + (next - value) / 2;
        REQUIRE(floatToHalf(value) == bits);
        REQUIRE(floatToHalf(-value) == (bits | 0x8000u));
        REQUIRE(floatToHalf(std::nextafter(middle, 0.0f)) == bits);
        REQUIRE(floatToHalf(std::nextafter(middle, inf)) == bits + 1);
        REQUIRE(floatToHalf(middle) == (bits % 2 == 0 ? bits : bits + 1));
    }
    CHECK(floatToHalf(inf) == 0x7c00);
    CHECK(floatToHalf(1e30f) == 0x7c00);
    CHECK(std::isnan(floatToHalf(nan) == 0x7e00 ? nan : 0.0f));
}

TEST_CASE("targets that cannot be written to are refused")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto renderer = open(model.view());
    const EyeParams eye = walk(0, 1)[0];
    std::vector<uint64_t> memory(size_t(eye.width) * eye.height * 2);
    unsigned char* const rows = reinterpret_cast<unsigned char*>(memory.data());
    const auto refused = [&](const FrameTarget& target) {
        CHECK_THROWS_AS(renderer->submit(oneEye(eye, target)), Error);
    };
    using Kind = FrameTarget::Kind;
    refused({Kind::Host, PixelFormat::Rgba8, nullptr, 0, 0});
    refused({Kind::Host, PixelFormat(uint32_t(PixelFormat::Bgra8) + 1), rows, 0, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows + 2, 0, 0});
    refused({Kind::Host, PixelFormat::Rgba16f, rows + 4, 0, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, size_t(eye.width) * 4 - 4, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, size_t(eye.width) * 4 + 2, 0});
    refused({Kind::Surface, PixelFormat::Rgba8, nullptr, 0, 1});
    float* const depths = reinterpret_cast<float*>(rows);
    refused({Kind::None, PixelFormat::Rgba8, nullptr, 0, 0, depths, 0, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, 0, 0, depths, size_t(eye.width) * 4 - 4, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, 0, 0, depths, size_t(eye.width) * 4 + 2, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, 0, 0, reinterpret_cast<float*>(rows + 2), 0, 0});
    refused({Kind::Host, PixelFormat::Rgba8, rows, 0, 0, nullptr, 0, 1});
    const FrameTarget two[2] = {};
    CHECK_THROWS_AS(renderer->submit({{&eye, 1}, two, FrameOptions{}}), Error);
    render(*renderer, oneEye(eye, {Kind::Device, PixelFormat::Rgba8, rows, 0, 0})); // the device is the host
    CHECK(rows[3] == 255);
}

TEST_CASE("tickets: two in flight, each waited for once, in any order")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
        const std::unique_ptr<Renderer> renderer = makeCpuRenderer(path, 1);
        const std::vector<EyeParams> eyes = walk(0, 1);
        CHECK_THROWS_AS(renderer->submit({eyes}), Error); // no model
        renderer->load(model.view());
        const uint64_t first = renderer->submit({eyes}), second = renderer->submit({eyes});
        CHECK(second == first + 1);
        CHECK_THROWS_WITH_AS(renderer->submit({eyes}), doctest::Contains("in flight"), Error);
        FrameResult result;
        while (renderer->wait(second, result, 1ms) == FrameState::Pending) {
        }
        CHECK(result.eyes[0].pairs > 0);
        CHECK_THROWS_WITH_AS(renderer->wait(second, result), doctest::Contains("not in flight"), Error);
        CHECK(renderer->wait(first, result) == FrameState::Done);
        (void)renderer->submit({eyes});
        renderer->load(model.view()); // forgets it
        CHECK_THROWS_AS(renderer->wait(second + 1, result), Error);
        (void)renderer->submit({eyes}); // and goes before it is drawn
    }
}

TEST_CASE("submit does not wait, a wait may end before the frame, and what drawing throws comes out of it")
{
    std::binary_semaphore go(0);
    FrameThread thread([&](const EyeParams*, uint32_t eye_count, const FrameOptions& options, float* const* images,
                           FrameResult& result, const DepthRows<float>*) {
        if (options.appearance == 1)
            throw Error(ErrorCode::OutOfMemory, "frame", "too little memory", "more", "draw less");
        go.acquire();
        CHECK(eye_count == 1);
        CHECK(images[0] == nullptr);
        result.passes = 7;
    });
    const EyeParams eye = walk(0, 1)[0];
    FrameRequest request{{&eye, 1}};
    const uint64_t first = thread.submit(request); // drawing has not begun to end
    request.options.appearance = 1;
    const uint64_t second = thread.submit(request);
    FrameResult result;
    CHECK(thread.wait(first, result, 0ns) == FrameState::Pending);
    CHECK(thread.wait(second, result, 1ms) == FrameState::Pending);
    go.release();
    constexpr auto ever = std::chrono::nanoseconds::max();
    CHECK(thread.wait(first, result, ever) == FrameState::Done);
    CHECK(result.passes == 7);
    CHECK_THROWS_WITH_AS(thread.wait(second, result, ever), "frame: too little memory, expected more; draw less",
                         Error);
    CHECK_THROWS_AS(thread.wait(second, result, ever), Error); // it has ended
    (void)thread.submit(request);
    thread.clear();
    CHECK_THROWS_WITH_AS(thread.wait(3, result, ever), doctest::Contains("not in flight"), Error);
}

TEST_CASE("a graphics card is a PCI device of a vendor and of the class of displays")
{
    const test::TemporaryFolder folder;
    const auto add = [&](const char* name, const char* vendor, const char* what) {
        std::filesystem::create_directory(folder.path() / name);
        std::ofstream(folder.path() / name / "vendor") << vendor << "\n";
        std::ofstream(folder.path() / name / "class") << what << "\n";
    };
    const std::string none = (folder.path() / "none").string();
    const auto found = [&] { return hasGraphicsCard(kNvidia, folder.path().string(), none); };
    CHECK_FALSE(hasGraphicsCard(kNvidia, none, none));
    add("0000:00:00.0", "0x8086", "0x030000"); // graphics of another vendor
    add("0000:00:01.0", "0x10de", "0x040300"); // sound
    std::filesystem::create_directory(folder.path() / "0000:00:02.0");
    CHECK_FALSE(found());
    add("0000:00:03.0", "0x10de", "0x030200"); // a GPU without a screen
    CHECK(found());
}

TEST_CASE("a graphics card is what a driver has a file for, where no PCI device is listed")
{
    for (const char* file : {"nvidia0", "dxg"}) {
        const test::TemporaryFolder folder;
        const std::string files = folder.path().string(), none = files + "/none";
        CHECK_FALSE(hasGraphicsCard(kNvidia, none, files));
        std::ofstream(folder.path() / file) << "";
        CHECK(hasGraphicsCard(kNvidia, none, files));
        CHECK_FALSE(hasGraphicsCard(0x8086, none, files));
    }
}

TEST_CASE("a device has one name; the CPU does what a better device cannot, where the choice is left open")
{
    const std::pair<DeviceId, const char*> names[] = {{{"cuda", 0}, "cuda:0"}, {{"cuda", 2}, "cuda:2"},
                                                      {{"cpu", 0}, "cpu"},     {{"cpu", 7}, "cpu:7"},
                                                      {{"auto", 0}, "auto"},   {{"rank", 1}, "rank:1"}};
    for (const auto& [device, name] : names)
        CHECK(deviceText(device) == name);
    CHECK(bestDevice({"cuda", 3}) == DeviceId{"cuda", 3}); // there or not
    CHECK(bestDevice({}).backend != "auto");

    const auto opened = [](const DeviceId& asked, const DeviceId& taken, ErrorCode code) {
        std::vector<std::string> passed_over;
        const DeviceId by = orOnCpu(
            asked, taken,
            [&](const DeviceId& on) {
                return on.backend == "cpu" ? on : throw Error(code, "model", "too large", "a smaller one", "draw less");
            },
            [&](const std::string& why) { passed_over.push_back(why); });
        CHECK(by == DeviceId{"cpu"});
        return passed_over;
    };
    for (const ErrorCode code : {ErrorCode::OutOfMemory, ErrorCode::Unsupported, ErrorCode::Device}) {
        CHECK(opened({}, {"cuda", 0}, code) ==
              std::vector<std::string>{
                  "backend cuda:0 is passed over: model: too large, expected a smaller one; draw less"});
        CHECK_THROWS_AS(opened({"cuda", 0}, {"cuda", 0}, code), Error); // it is what was asked for
        CHECK_THROWS_AS(opened({}, {"cpu"}, code), Error);              // has failed already
    }
    CHECK_THROWS_AS(opened({}, {"cuda", 0}, ErrorCode::Usage), Error); // a failure without a device
}
