// SPDX-License-Identifier: Apache-2.0
// The renderer interface on a GPU: targets, two frames in flight, several renderers, a device that is lost.
#include "tests/kernels/gpu_buffers.h"
#include "tests/backends/reuse_scene.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <cstring>
#include <thread>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr auto kForever = std::chrono::nanoseconds::max();

SyntheticOptions levels()
{
    return octree(LevelRule::Round, 1500, 1);
}

using Picture = std::vector<float>;

struct Frame {
    std::vector<EyeParams> eyes;
    Picture pictures[kMaxEyes];
    FrameTarget targets[kMaxEyes];
    FrameRequest request;
    uint64_t ticket = 0;
    uint32_t passes = 0, repeats = 0;
};

enum class How { OneByOne, TwoInFlight, Polled, NewestFirst };

// Frames of a walk, drawn in one of the ways a caller may choose.
std::vector<Frame> drawWalk(Renderer& renderer, const FrameOptions& options, size_t count, How how)
{
    std::vector<Frame> frames(count);
    const auto submit = [&](Frame& frame) { frame.ticket = renderer.submit(frame.request); };
    const auto end = [&](Frame& frame) {
        FrameResult result;
        FrameState state = FrameState::Pending;
        while (state == FrameState::Pending)
            state =
                renderer.wait(frame.ticket, result, how == How::Polled ? std::chrono::nanoseconds::zero() : kForever);
        frame.passes = result.passes;
        if (state == FrameState::Done)
            return;
        ++frame.repeats;
        FrameRequest again = frame.request;
        again.repeats = frame.ticket;
        frame.repeats += finish(renderer, again, renderer.submit(again)).repeats;
    };
    for (size_t i = 0; i < count; ++i) {
        Frame& frame = frames[i];
        frame.eyes = walk(int(i), 2);
        for (size_t e = 0; e < 2; ++e) {
            frame.pictures[e].assign(size_t(3) * frame.eyes[e].width * frame.eyes[e].height, -7.0f);
            frame.targets[e] = hostTarget(frame.pictures[e].data());
        }
        frame.request = {frame.eyes, frame.targets, options};
    }
    if (how == How::OneByOne) {
        for (Frame& frame : frames) {
            submit(frame);
            end(frame);
        }
    } else if (how == How::NewestFirst) {
        for (size_t i = 0; i + 1 < count; i += 2) {
            submit(frames[i]);
            submit(frames[i + 1]);
            end(frames[i + 1]);
            end(frames[i]);
        }
    } else {
        submit(frames[0]);
        for (size_t i = 1; i < count; ++i) {
            submit(frames[i]);
            end(frames[i - 1]);
        }
        end(frames[count - 1]);
    }
    return frames;
}

bool sameWalk(const std::vector<Frame>& a, const std::vector<Frame>& b)
{
    bool same = a.size() == b.size();
    for (size_t i = 0; same && i < a.size(); ++i)
        for (size_t e = 0; e < 2; ++e)
            same = same && sameBytes(a[i].pictures[e], b[i].pictures[e]);
    return same;
}

} // namespace

TEST_CASE("renderer: two frames in flight draw what one after the other does, however they are waited for")
{
    const SyntheticModel model(levels());
    FrameOptions lag = onGrey(Tier::Fast);
    lag.lod_hysteresis = 0.5f;
    for (const FrameOptions& options : {lag, with(ReusePolicy::Depth, 0, 2)}) {
        CAPTURE(uint32_t(options.reuse.policy));
        const auto wanted = drawWalk(*open(model.view()), options, 4, How::OneByOne);
        for (const How how : {How::TwoInFlight, How::Polled, How::NewestFirst}) {
            CAPTURE(int(how));
            CHECK(sameWalk(drawWalk(*open(model.view()), options, 4, how), wanted));
        }
    }
}

TEST_CASE("renderer: passes follow from what was submitted, not from what was ready")
{
    const SyntheticModel model({.anchors = 6000 * kManyAnchors, .log_scale = -3.5f});
    const FrameOptions options = onGrey(Tier::Fast);
    const uint64_t context = cudaRenderer().device().context_bytes;
    const auto roomy = makeRenderer({"cuda"});
    roomy->load(model.view());
    const std::vector<Frame> whole = drawWalk(*roomy, options, 4, How::TwoInFlight);
    FrameResult result;
    const uint64_t all = render(*roomy, whole[0].eyes, options)[0].result.bytes_resident - context;
    bool several = false;
    for (uint64_t part = all; part > all / 8 && !several; part = part * 13 / 16) {
        const auto draw = [&](How how) {
            const auto gpu = makeRenderer({"cuda"}, {0, context + part});
            gpu->load(model.view());
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

TEST_CASE("renderer: two on threads of their own, on two devices where there are two, draw the bytes of one")
{
    const SyntheticModel model(levels());
    int devices_here = 0;
    GSC_CUDA_CHECK(cudaGetDeviceCount(&devices_here));
    const auto on = [&](int ordinal) {
        auto gpu = makeRenderer({"cuda", ordinal});
        gpu->load(model.view());
        return gpu;
    };
    CHECK_THROWS_WITH_AS(on(devices_here), doctest::Contains("of its devices"), Error);
    const FrameOptions options = with(ReusePolicy::Depth, 0, 2);
    const std::vector<Frame> wanted = drawWalk(*on(0), options, 4, How::OneByOne);
    std::vector<Frame> drawn[2];
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&, i] {
            const auto gpu = on(i % devices_here);
            CHECK(gpu->id().ordinal == i % devices_here);
            drawn[i] = drawWalk(*gpu, options, 4, How::TwoInFlight);
        });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(sameWalk(drawn[0], wanted));
    CHECK(sameWalk(drawn[1], wanted));
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
