// SPDX-License-Identifier: Apache-2.0
// The renderer interface on a GPU: targets, two frames in flight, several renderers, a device that is lost.
#include "tests/kernels/gpu_buffers.h"
#include "tests/backends/walk_frames.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions levels()
{
    return octree(LevelRule::Round, 1500, 1);
}

} // namespace

TEST_CASE("renderer: passes follow from what was submitted, not from what was ready")
{
    const SyntheticModel model({.anchors = 6000 * kManyAnchors, .log_scale = -3.5f});
    const FrameOptions options = onGrey(Tier::Fast);
    const uint64_t context = cudaRenderer().device().context_bytes;
    const auto roomy = open(model.view());
    const std::vector<Frame> whole = drawWalk(*roomy, options, 4, How::TwoInFlight);
    FrameResult result;
    const uint64_t all = render(*roomy, whole[0].eyes, options)[0].result.bytes_resident - context;
    bool several = false;
    for (uint64_t part = all; part > all / 8 && !several; part = part * 13 / 16) {
        const auto draw = [&](How how) {
            const auto gpu = open(model.view(), {"cuda"}, {0, context + part});
            return drawWalk(*gpu, options, 4, how);
        };
        const std::vector<Frame> wanted = draw(How::TwoInFlight);
        several = wanted[3].passes > 1;
        if (!several)
            continue;
        bool repeats = false;
        for (const Frame& frame : wanted)
            repeats = repeats || frame.repeats > 0;
        for (const How how : {How::Polled, How::OneByOne}) {
            if (how == How::OneByOne && repeats)
                continue; // other frames are submitted
            const std::vector<Frame> others = draw(how);
            CHECK(sameWalk(others, wanted));
            for (size_t i = 0; i < others.size(); ++i) {
                CHECK(others[i].passes == wanted[i].passes);
                CHECK(others[i].repeats == wanted[i].repeats);
            }
        }
        CHECK(sameWalk(wanted, whole));
    }
    CHECK(several);
}

TEST_CASE("renderer: a frame that overflows may be dropped, and those after it are whole")
{
    SyntheticOptions many{.anchors = 3000};
    many.log_scale = -1.5f; // pairs, of which there is room for few, are what grows
    const SyntheticModel model(many);
    const std::vector<EyeParams> eyes = walk(0, 2);
    const auto plain = makeRenderer({"cuda"}), dropping = makeRenderer({"cuda"});
    plain->load(model.view());
    dropping->load(model.view());
    const auto wanted = render(*plain, eyes, onGrey(Tier::Fast));
    Picture picture(wanted[0].pixels.size());
    const FrameTarget targets[2] = {hostTarget(picture.data()), {}};
    FrameResult result;
    uint32_t dropped = 0;
    for (int i = 0; i < 12; ++i)
        dropped += dropping->wait(dropping->submit({eyes, targets, onGrey(Tier::Fast)}), result) != FrameState::Done;
    CHECK(dropped < 8); // each drop is learned from
    CHECK(sameBytes(picture, wanted[0].pixels));
}

TEST_CASE("renderer: a picture in device memory is the one on the host, byte for byte, in every format")
{
    const SyntheticModel model(levels());
    const auto gpu = open(model.view());
    const std::vector<EyeParams> eyes = walk(0, 2);
    const uint32_t width = eyes[1].width, height = eyes[1].height;
    const Picture plain = render(*gpu, eyes, onGrey(Tier::Fast))[1].pixels;
    for (const PixelFormat format :
         {PixelFormat::Rgb32f, PixelFormat::Rgba16f, PixelFormat::Rgba8, PixelFormat::Bgra8}) {
        CAPTURE(uint32_t(format));
        const size_t pixel = pixelBytes(format), pitch = width * pixel + 32;
        const std::vector<unsigned char> wanted = inTarget(plain, width, format, pitch, 0xff);
        const GuardedBuffer<unsigned char> memory(pitch * height);
        std::vector<unsigned char> host(pitch * height, 0xff);
        const size_t depth_pitch = (width + 5) * sizeof(float);
        const GuardedBuffer<float> depths(depth_pitch / sizeof(float) * height);
        std::vector<float> own_depths(depth_pitch / sizeof(float) * height, -7.0f);
        const FrameTarget device[2] = {
            {}, {FrameTarget::Kind::Device, format, memory.get(), pitch, 0, depths.get(), depth_pitch, 0}};
        const uint64_t ticket = gpu->submit({eyes, device, onGrey(Tier::Fast)});
        const FrameTarget own[2] = {
            {}, {FrameTarget::Kind::Host, format, host.data(), pitch, 0, own_depths.data(), depth_pitch, 0}};
        const uint64_t second = gpu->submit({eyes, own, onGrey(Tier::Fast)});
        GSC_CUDA_CHECK(cudaEventSynchronize(static_cast<cudaEvent_t>(gpu->readyEvent(ticket))));
        CHECK(memory.read() == wanted); // before wait()
        FrameResult result;
        CHECK(gpu->wait(ticket, result) == FrameState::Done);
        CHECK(result.times.total >= result.times.select + result.times.blend);
        CHECK(gpu->wait(second, result) == FrameState::Done);
        CHECK(host == wanted);
        CHECK(memory.intact());
        const std::vector<float> device_depths = depths.read();
        bool same = true;
        for (size_t i = 0; i < own_depths.size(); ++i)
            same = same && (i % (width + 5) < width ? own_depths[i] == device_depths[i] : own_depths[i] == -7);
        CHECK(same);
        CHECK(depths.intact());
    }
}

TEST_CASE("renderer: a mapped surface has the bytes of memory")
{
    const SyntheticModel model(levels());
    const auto gpu = open(model.view());
    const std::vector<EyeParams> eyes = walk(0, 1);
    const size_t row = eyes[0].width * size_t(4);
    std::vector<unsigned char> wanted(row * eyes[0].height), got(wanted.size());
    std::vector<float> depths(wanted.size() / 4), got_depths(depths.size());
    const FrameTarget host{FrameTarget::Kind::Host, PixelFormat::Rgba8, wanted.data(), 0, 0, depths.data(), 0, 0};
    (void)render(*gpu, {eyes, {&host, 1}, onGrey(Tier::Fast)});
    FrameTarget target{FrameTarget::Kind::Surface, PixelFormat::Rgba8, nullptr, 0, 0};
#ifdef GSC_CUDA_EMULATION
    const gsc_emulation::Surface surface{got.data(), row};
    const gsc_emulation::Surface depth_surface{reinterpret_cast<unsigned char*>(got_depths.data()), row};
    target.surface = reinterpret_cast<uintptr_t>(&surface);
    target.depth_surface = reinterpret_cast<uintptr_t>(&depth_surface);
    (void)render(*gpu, {eyes, {&target, 1}, onGrey(Tier::Fast)});
#else
    struct Mapped { // an array of a word a pixel and its surface
        cudaArray_t array = nullptr;
        unsigned long long surface = 0;

        Mapped(const cudaChannelFormatDesc& words, const EyeParams& eye)
        {
            GSC_CUDA_CHECK(cudaMallocArray(&array, &words, eye.width, eye.height, cudaArraySurfaceLoadStore));
            cudaResourceDesc resource{};
            resource.resType = cudaResourceTypeArray;
            resource.res.array.array = array;
            GSC_CUDA_CHECK(cudaCreateSurfaceObject(&surface, &resource));
        }
        void read(void* to, size_t row_bytes, size_t height) const
        {
            GSC_CUDA_CHECK(cudaMemcpy2DFromArrayAsync(to, row_bytes, array, 0, 0, row_bytes, height,
                                                      cudaMemcpyDeviceToHost, testStream().handle));
            GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
            cudaDestroySurfaceObject(surface);
            cudaFreeArray(array);
        }
    };
    const Mapped pixels({8, 8, 8, 8, cudaChannelFormatKindUnsigned}, eyes[0]);
    const Mapped deep({32, 0, 0, 0, cudaChannelFormatKindFloat}, eyes[0]);
    target.surface = pixels.surface;
    target.depth_surface = deep.surface;
    (void)render(*gpu, {eyes, {&target, 1}, onGrey(Tier::Fast)});
    pixels.read(got.data(), row, eyes[0].height);
    deep.read(got_depths.data(), row, eyes[0].height);
#endif
    CHECK(got == wanted);
    CHECK(got_depths == depths);
}

// A device that is lost takes all renderers of the process with it, so on a GPU this runs in a process of its own
// (test_cuda_lost).
TEST_CASE("renderer: a lost device says so, and another renderer can be made where the driver allows it" *
          doctest::skip(
#ifdef GSC_CUDA_EMULATION
              false
#else
              true
#endif
              ))
{
    const SyntheticModel model(levels());
    const std::vector<EyeParams> eyes = walk(0, 1);
#ifdef GSC_CUDA_EMULATION
    constexpr int kOrdinal = 1; // nothing else of this process is there
#else
    constexpr int kOrdinal = 0;
#endif
    std::unique_ptr<Renderer> gpu = makeRenderer({"cuda", kOrdinal});
    gpu->load(model.view());
    const Picture wanted = render(*gpu, eyes, onGrey(Tier::Fast))[0].pixels;
    const auto fails = [](const auto& call) {
        try {
            call();
        } catch (const Error& error) {
            return error.code() == ErrorCode::Device;
        }
        return false;
    };
    FrameTarget target{};
#ifdef GSC_CUDA_EMULATION
    const uint64_t ticket = gpu->submit({eyes, {&target, 1}, onGrey(Tier::Fast)});
    gsc_emulation::loseDevices();
#else
    target = {FrameTarget::Kind::Device, PixelFormat::Rgba8, reinterpret_cast<void*>(uintptr_t(64)), 0, 0}; // not ours
    const uint64_t ticket = gpu->submit({eyes, {&target, 1}, onGrey(Tier::Fast)});
#endif
    CHECK(fails([&] {
        FrameResult result;
        (void)gpu->wait(ticket, result);
    }));
    CHECK(fails([&] { (void)gpu->submit({eyes, {}, onGrey(Tier::Fast)}); }));
    CHECK(fails([&] { gpu->load(model.view()); }));
    gpu.reset();
    try {
        gpu = makeRenderer({"cuda", kOrdinal});
    } catch (const Error& error) { // some drivers give a process no second context after a fault
#ifdef GSC_CUDA_EMULATION
        throw;
#endif
        CHECK(error.code() == ErrorCode::Device);
        MESSAGE("not made anew: " << std::string(error.what()));
        return;
    }
    gpu->load(model.view());
    CHECK(sameBytes(render(*gpu, eyes, onGrey(Tier::Fast))[0].pixels, wanted));
}
