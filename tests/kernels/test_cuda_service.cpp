// SPDX-License-Identifier: Apache-2.0
// A renderer service with workers on GPUs, two devices where there are two: the bytes of one renderer.
#include <gsc/error.h>
#include "runtime/service/faulty_renderer.h"
#include "runtime/devices/device_pictures.h"
#include "tests/kernels/gpu_buffers.h"
#include "tests/backends/reuse_scene.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

using Bytes = std::vector<unsigned char>;

int devicesHere()
{
    int count = 0;
    GSC_CUDA_CHECK(cudaGetDeviceCount(&count));
    return count;
}

ServiceOptions gpuWorkers(int count, ServiceMode mode)
{
    ServiceOptions options;
    options.devices.clear();
    for (int i = 0; i < count; ++i)
        options.devices.push_back({"cuda", i % devicesHere()});
    options.mode = mode;
    options.keeps_all = true;
    return options;
}

FrameOptions plain(Tier tier)
{
    FrameOptions options;
    options.tier = tier;
    options.background[1] = 0.25f;
    return options;
}

void readBytes(void* to, const void* from, size_t size)
{
    GSC_CUDA_CHECK(cudaMemcpyAsync(to, from, size, cudaMemcpyDeviceToHost, testStream().handle));
    GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
}

// All eyes' bytes, wherever the pictures are.
Bytes bytesOf(const FrameTarget* targets, const std::vector<EyeParams>& eyes)
{
    Bytes all;
    for (size_t e = 0; e < eyes.size(); ++e) {
        Bytes own(size_t(4) * eyes[e].width * eyes[e].height);
        if (targets[e].kind == FrameTarget::Kind::Device)
            readBytes(own.data(), targets[e].pixels, own.size());
        else
            std::memcpy(own.data(), targets[e].pixels, own.size());
        all.insert(all.end(), own.begin(), own.end());
    }
    return all;
}

Bytes byOne(Renderer& renderer, const std::vector<EyeParams>& eyes, const FrameOptions& options)
{
    std::vector<Bytes> pictures;
    std::vector<FrameTarget> targets;
    for (const EyeParams& eye : eyes) {
        Bytes& own = pictures.emplace_back(size_t(4) * eye.width * eye.height);
        targets.push_back({FrameTarget::Kind::Host, PixelFormat::Rgba8, own.data(), 0, 0});
    }
    for (size_t e = 0; e < eyes.size(); ++e)
        targets[e].pixels = pictures[e].data();
    render(renderer, {eyes, targets, options});
    return bytesOf(targets.data(), eyes);
}

// Share of values that differ, of which none may by more than one.
double othersIn(const Bytes& a, const Bytes& b)
{
    REQUIRE(a.size() == b.size());
    size_t others = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        CHECK_MESSAGE(std::abs(int(a[i]) - int(b[i])) <= 1, i);
        others += a[i] != b[i];
    }
    return double(others) / double(a.size());
}

void submit(RendererService& service, const std::vector<EyeParams>& eyes, const FrameOptions& options, bool on_device)
{
    PoseRequest request;
    request.eyes = eyes;
    request.options = options;
    request.on_device = on_device;
    (void)service.submit(request);
}

} // namespace

TEST_CASE("service: every mode delivers one renderer's bytes, to the host and to the first device")
{
    SyntheticOptions made = modelOptions(LevelRule::Round);
    const SyntheticModel model(made);
    const auto one = open(model.view());
    constexpr int kPoses = 4;
    for (const Tier tier : {Tier::Exact, Tier::Fast})
        for (const ServiceMode mode : {ServiceMode::Frame, ServiceMode::Eye, ServiceMode::Split})
            for (const bool on_device : {false, true}) {
                CAPTURE(uint32_t(tier));
                CAPTURE(serviceModeName(mode));
                CAPTURE(on_device);
                RendererService service(model.view(), gpuWorkers(2, mode));
                for (int i = 0; i < kPoses; ++i)
                    submit(service, walk(i, 2), plain(tier), on_device);
                for (int i = 0; i < kPoses; ++i) {
                    const auto delivery = service.next();
                    REQUIRE(delivery);
                    if (delivery->error)
                        std::rethrow_exception(delivery->error);
                    CHECK((delivery->eyes[0].kind == FrameTarget::Kind::Device) == on_device);
                    const Bytes got = bytesOf(delivery->eyes, walk(i, 2)),
                                wanted = byOne(*one, walk(i, 2), plain(tier));
                    if (tier == Tier::Exact)
                        CHECK(got == wanted);
                    else
                        CHECK(othersIn(got, wanted) < 1e-3);
                }
            }
}

TEST_CASE("service: GPU and CPU work together, and what the CPU draws is brought to the GPU")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = gpuWorkers(2, ServiceMode::Eye);
    options.devices[1] = {"cpu"};
    RendererService service(model.view(), options);
    submit(service, walk(0, 2), plain(Tier::Exact), true);
    const auto delivery = service.next();
    REQUIRE(delivery);
    REQUIRE(delivery->end == PoseEnd::Shown);
    const auto cpu = open(model.view(), "cpu", 0);
    CHECK(othersIn(bytesOf(delivery->eyes, walk(0, 2)), byOne(*cpu, walk(0, 2), plain(Tier::Exact))) < 0.01);
}

TEST_CASE("service: a pose that one of its GPUs would not draw is refused as it is handed in")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions workers = gpuWorkers(1, ServiceMode::Frame);
    workers.devices.insert(workers.devices.begin(), DeviceId{"cpu"});
    RendererService service(model.view(), workers);
    const PoseRequest pose{.eyes = walk(0, 1), .options = with(ReusePolicy::Error)};
    CHECK_THROWS_WITH_AS(service.submit(pose), doctest::Contains("draw with a detail"), Error);
}

TEST_CASE("service: a bridge brings columns of a picture to their place and leaves the others")
{
    constexpr size_t kPitch = 400, kRows = 90, kFirst = 128, kBytes = 96, kOffset = 256;
    const auto gpu = makeRenderer({"cuda", 0}), cpu = makeRenderer({"cpu"});
    const std::shared_ptr<PictureMemory> pictures = devicePictures({"cuda", 0});
    for (const Renderer* from : {gpu.get(), cpu.get()}) {
        const std::unique_ptr<PictureBridge> bridge = bridgeTo(*pictures, *from);
        REQUIRE(bridge != nullptr);
        const FrameTarget buffer = bridge->buffer(1, kOffset + kPitch * kRows);
        const bool on_host = buffer.kind == FrameTarget::Kind::Host;
        CHECK(on_host == from->onHost());
        Bytes drawn(kOffset + kPitch * kRows), before(drawn.size(), 0x11);
        for (size_t i = 0; i < drawn.size(); ++i)
            drawn[i] = static_cast<unsigned char>(i * 7 % 251);
        const std::shared_ptr<std::byte> picture = pictures->take(drawn.size());
        const auto write = [&](void* to, const Bytes& bytes) {
            GSC_CUDA_CHECK(
                cudaMemcpyAsync(to, bytes.data(), bytes.size(), cudaMemcpyHostToDevice, testStream().handle));
            GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
        };
        on_host ? void(std::memcpy(buffer.pixels, drawn.data(), drawn.size())) : write(buffer.pixels, drawn);
        write(picture.get(), before);
        bridge->land(1, picture.get(), {kOffset + kFirst, kPitch, kBytes, kRows});
        bridge->finish();
        Bytes got(drawn.size());
        readBytes(got.data(), picture.get(), got.size());
        size_t wrong = 0;
        for (size_t i = 0; i < got.size(); ++i) {
            const size_t x = i < kOffset ? 0 : (i - kOffset) % kPitch;
            wrong += got[i] != (x >= kFirst && x < kFirst + kBytes ? drawn[i] : 0x11);
        }
        CHECK(wrong == 0);
        bridge->land(1, picture.get(), {kOffset, kPitch, kPitch, kRows}); // rows without a gap
        bridge->finish();
        readBytes(got.data(), picture.get(), got.size());
        CHECK(std::equal(got.begin() + kOffset, got.end(), drawn.begin() + kOffset));
    }
}

TEST_CASE("service: injected faults on GPUs cost no pose, and their memory goes back")
{
    const SyntheticModel model(modelOptions());
    const auto one = open(model.view());
    Faults faults;
    faults.throws = faults.lost = faults.memory = 0.1;
    ServiceOptions options = gpuWorkers(2, ServiceMode::Split);
    options.make = withFaults(faults);
    options.comes_back = std::chrono::milliseconds(1);
    options.most_faults = options.attempts = 1000;
    const auto freeBytes = [] {
        size_t left = 0, total = 0;
        GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
        return double(left);
    };
    (void)byOne(*one, walk(0, 2), plain(Tier::Exact)); // its buffers are made
    const double before = freeBytes();
    auto owner = std::make_unique<RendererService>(model.view(), options);
    RendererService& service = *owner;
    for (int i = 0; i < 12; ++i)
        submit(service, walk(i, 2), plain(Tier::Exact), i % 2 == 0);
    for (int i = 0; i < 12; ++i) {
        const auto delivery = service.next();
        REQUIRE(delivery);
        REQUIRE(delivery->end == PoseEnd::Shown);
        CHECK(bytesOf(delivery->eyes, walk(i, 2)) == byOne(*one, walk(i, 2), plain(Tier::Exact)));
    }
    uint32_t seen = 0;
    for (const WorkerStats& worker : service.stats().workers)
        seen += worker.faults;
    CHECK(seen > 0);
    owner.reset();
    const bool is_emulated = one->device().name == "emulated";
    CHECK(before - freeBytes() <= (is_emulated ? 0 : 32e6)); // a driver keeps some for itself
}
