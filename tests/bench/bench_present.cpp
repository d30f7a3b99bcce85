// SPDX-License-Identifier: Apache-2.0
// Cost of bringing two eyes of a GPU to images of its Vulkan, without a window: hand-over and copy, warm, and whether
// every pixel arrives.
//
// usage: bench_present MODEL.gsc [WIDTHxHEIGHT] [FRAMES]
#include <gsc/error.h>
#include "runtime/cameras/trainer_cameras.h"
#include "runtime/module/load_module.h"
#include "player/present/hand_over_ring.h"
#include "runtime/service/renderer_service.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

using namespace gsc;
using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point from)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - from).count();
}

double percentile(std::vector<double> values, double share)
{
    std::ranges::sort(values);
    return values[size_t(share * double(values.size() - 1))];
}

Delivery draw(RendererService& service, const EyeParams (&eyes)[2], bool on_device)
{
    PoseRequest request;
    request.eyes.assign(eyes, eyes + 2);
    request.on_device = on_device;
    (void)service.submit(request);
    std::optional<Delivery> drawn = service.next(std::chrono::minutes(1));
    if (!drawn || drawn->end != PoseEnd::Shown)
        throw Error(ErrorCode::Device, "bench_present", "no picture came", "one", "look at the device");
    return std::move(*drawn);
}

void place(ShownPicture (&pictures)[2], uint32_t width, uint32_t height)
{
    for (uint32_t e = 0; e < 2; ++e) {
        pictures[e].width = width;
        pictures[e].height = height;
        pictures[e].x = e * width;
    }
}

void run(const char* path, uint32_t width, uint32_t height, int frames)
{
    const std::shared_ptr<const Scene> scene = Scene::open(path);
    ServiceOptions options;
    options.devices = {{"cuda", 0}};
    options.keeps_all = true;
    RendererService service(scene, options);

    PresenterOptions display;
    display.windowed = false;
    display.device = deviceUuid(options.devices.front());
    const std::unique_ptr<Presenter> presenter = loadModule<PresentFunctions>("gsc_present").open(display);
    if (!presenter->sharesMemory())
        throw Error(ErrorCode::Unsupported, "bench_present",
                    "Vulkan's device " + presenter->deviceName() + " shares no memory", "that of cuda:0",
                    "choose that GPU");
    HandOverRing ring(*presenter, options.devices.front());

    std::vector<double> wall, gpu;
    Camera last[2];
    uint64_t wrong = 0, pixels = 0;
    for (int i = 0; i < frames; ++i) {
        Camera left, right, camera = cameraOf(scene->cameras()[size_t(i) % scene->cameras().size()]);
        finishCamera(camera, width, height, 1.57);
        stereoPair(camera, 0.05, left, right);
        const EyeParams eyes[2] = {eyeParams(left, scene->view().origin), eyeParams(right, scene->view().origin)};
        const Delivery on_host = draw(service, eyes, false), drawn = draw(service, eyes, true);

        last[0] = left;
        last[1] = right;
        ShownPicture pictures[2];
        place(pictures, width, height);
        const void* const from[2] = {drawn.eyes[0].pixels, drawn.eyes[1].pixels};
        FrameToShow frame{pictures, 2 * width, height, false};
        for (const bool reads_back : {false, true}) { // the first is timed
            frame.reads_back = reads_back;
            presenter->finish();
            const Clock::time_point start = Clock::now();
            ring.handOver(pictures, from);
            (void)presenter->show(frame, nullptr);
            presenter->finish();
            if (!reads_back) {
                wall.push_back(msSince(start));
                gpu.push_back(presenter->times().copy_ms);
            }
        }
        uint32_t w = 0, h = 0;
        const std::vector<std::byte> shown = presenter->readBack(w, h);
        for (uint32_t e = 0; e < 2; ++e)
            for (uint32_t y = 0; y < height; ++y) {
                const auto* const expected =
                    static_cast<const std::byte*>(on_host.eyes[e].pixels) + size_t(y) * width * 4;
                const std::byte* const got = shown.data() + (size_t(y) * w + size_t(e) * width) * 4;
                for (uint32_t x = 0; x < width; ++x)
                    wrong += std::memcmp(expected + size_t(4) * x, got + size_t(4) * x, 4) != 0;
            }
        pixels += uint64_t(2) * width * height;
    }
    // one frame behind the other, as a display that is never late would have them
    constexpr int kStream = 300;
    const EyeParams eyes[2] = {eyeParams(last[0], scene->view().origin), eyeParams(last[1], scene->view().origin)};
    const Delivery drawn = draw(service, eyes, true);
    ShownPicture pictures[2];
    place(pictures, width, height);
    const void* const from[2] = {drawn.eyes[0].pixels, drawn.eyes[1].pixels};
    const FrameToShow frame{pictures, 2 * width, height, false};
    presenter->finish();
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < kStream; ++i) {
        ring.handOver(pictures, from);
        (void)presenter->show(frame, nullptr);
    }
    presenter->finish();
    const double streamed = msSince(start) / kStream;

    const size_t warm = std::min<size_t>(10, wall.size() / 2);
    wall.erase(wall.begin(), wall.begin() + ptrdiff_t(warm));
    gpu.erase(gpu.begin(), gpu.begin() + ptrdiff_t(warm));
    std::printf(
        "%s: two eyes of %ux%u, %zu frames after %zu: from hand-over until the image is there, of the host: median "
        "%.3f ms, p99 %.3f; the copy alone, of the GPU: median %.3f, p99 %.3f; one frame behind the other: %.3f each; "
        "%llu of %llu pixels wrong\n",
        presenter->deviceName().c_str(), width, height, wall.size(), warm, percentile(wall, 0.5),
        percentile(wall, 0.99), percentile(gpu, 0.5), percentile(gpu, 0.99), streamed,
        static_cast<unsigned long long>(wrong), static_cast<unsigned long long>(pixels));
    if (wrong > 0)
        throw Error(ErrorCode::Difference, "bench_present", "pixels differ", "the same", "look at the copies");
}

} // namespace

int main(int argc, char** argv)
{
    unsigned width = 2064, height = 2208;
    if (argc < 2 || (argc > 2 && std::sscanf(argv[2], "%ux%u", &width, &height) != 2)) {
        std::fprintf(stderr, "usage: bench_present MODEL.gsc [WIDTHxHEIGHT] [FRAMES]\n");
        return 1;
    }
    try {
        run(argv[1], width, height, argc > 3 ? std::max(2, std::atoi(argv[3])) : 60);
    } catch (const gsc::Error& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return int(e.code());
    }
    return 0;
}
