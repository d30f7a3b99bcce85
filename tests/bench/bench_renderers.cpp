// SPDX-License-Identifier: Apache-2.0
// Time that the renderer interface costs beside the device's own: one renderer, then one on each of several devices at
// once, each with a thread of its own, two frames in flight. And the time that a target costs: bytes on the device,
// bytes for the host, and one that takes depths too.
//
//   bench_renderers FILE.gsc [devices = 1] [frames = 300] [backend = cuda]
//
// Two eyes of 2048x2048 at the file's cameras. Per renderer, medians: wall from the end of a frame to the end of the next,
// device time of a frame, their difference, and what submit() takes.
#include "runtime/cameras/camera_file.h"
#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include <gsc/renderer.h>
#ifdef GSC_HAVE_CUDA
#include "kernels/cuda/cuda_check.h"
#endif

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <latch>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

using namespace gsc;

namespace {

using Clock = std::chrono::steady_clock;

double millisecondsBetween(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::milli>(to - from).count();
}

double median(std::vector<double> values)
{
    std::nth_element(values.begin(), values.begin() + ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
}

struct Pose {
    EyeParams eyes[kMaxEyes];
    FrameOptions options;
};

struct Times {
    std::vector<double> wall, device, over, submit; // ms
};

Times run(Renderer& renderer, const std::vector<Pose>& poses, size_t frames, std::span<const FrameTarget> targets = {})
{
    const size_t warm = std::min<size_t>(poses.size(), 50);
    Times times;
    std::vector<FrameRequest> requests;
    std::vector<uint64_t> tickets;
    Clock::time_point last;
    const auto end = [&](size_t i) {
        const FrameResult result = finish(renderer, requests[i], tickets[i]);
        const Clock::time_point now = Clock::now();
        if (i >= warm) {
            times.wall.push_back(millisecondsBetween(last, now));
            times.device.push_back(result.times.total);
            times.over.push_back(times.wall.back() - times.device.back());
        }
        last = now;
    };
    for (size_t i = 0; i < warm + frames; ++i) {
        const Pose& pose = poses[i % poses.size()];
        requests.push_back({pose.eyes, targets, pose.options});
        const Clock::time_point start = Clock::now();
        tickets.push_back(renderer.submit(requests[i]));
        if (i >= warm)
            times.submit.push_back(millisecondsBetween(start, Clock::now()));
        if (i > 0)
            end(i - 1);
    }
    end(requests.size() - 1);
    return times;
}

void print(const std::string& name, const Times& times)
{
    double wall = 0, device = 0;
    for (size_t i = 0; i < times.wall.size(); ++i) {
        wall += times.wall[i];
        device += times.device[i];
    }
    const auto frames = double(times.wall.size());
    std::printf("%-10s wall %8.4f ms (mean %8.4f), device %8.4f (mean %8.4f), wall - device %7.2f us (mean %7.2f), "
                "submit %6.2f us\n",
                name.c_str(), median(times.wall), wall / frames, median(times.device), device / frames,
                1000 * median(times.over), 1000 * (wall - device) / frames, 1000 * median(times.submit));
}

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2)
        return 2;
    try {
        const int devices = argc > 2 ? std::atoi(argv[2]) : 1;
        const size_t frames = argc > 3 ? size_t(std::atoi(argv[3])) : 300;
        const std::string backend = argc > 4 ? argv[4] : "cuda";
        const std::shared_ptr<const Scene> scene = Scene::open(argv[1]);
        PlayOptions options;
        options.model.file = argv[1];
        options.view.eyes = 2;
        options.view.width = options.view.height = 2048;
        options.view.fov_x = std::numbers::pi / 2;
        Reporter log({.quiet = true});
        std::vector<Pose> poses;
        for (const Shot& shot : chooseShots(*scene, options.model.file, options.cameras, options.view, log)) {
            Pose& pose = poses.emplace_back();
            shotEyes(shot, 2, pose.eyes);
            pose.options = frameOptions(*scene, options.frame);
            pose.options.appearance = shotAppearance(*scene, shot);
        }
        std::vector<std::unique_ptr<Renderer>> renderers;
        for (int i = 0; i < devices; ++i) {
            renderers.push_back(makeRenderer({backend, i}));
            renderers.back()->load(scene);
        }
        print("alone", run(*renderers[0], poses, frames));
#ifdef GSC_HAVE_CUDA
        if (backend == "cuda") {
            FrameTarget targets[kMaxEyes];
            for (FrameTarget& to : targets) {
                to = {FrameTarget::Kind::Device, PixelFormat::Rgba8, nullptr, 0, 0};
                GSC_CUDA_CHECK(cudaMalloc(&to.pixels, size_t(4) * options.view.width * options.view.height));
            }
            print("on device", run(*renderers[0], poses, frames, targets));
            for (const FrameTarget& to : targets)
                GSC_CUDA_CHECK(cudaFree(to.pixels));
        }
#endif
        std::vector<uint32_t> pixels(size_t(options.view.width) *
                                     options.view.height); // pixels of both eyes, which nobody looks at
        std::vector<float> depths(pixels.size());
        FrameTarget target{FrameTarget::Kind::Host, PixelFormat::Rgba8, pixels.data(), 0, 0};
        print("to host", run(*renderers[0], poses, frames, std::vector(kMaxEyes, target)));
        target.depth = depths.data();
        print("and depth", run(*renderers[0], poses, frames, std::vector(kMaxEyes, target)));
        std::vector<Times> times(renderers.size());
        std::vector<std::thread> threads;
        std::latch ready(devices);
        for (size_t i = 0; devices > 1 && i < renderers.size(); ++i)
            threads.emplace_back([&, i] {
                ready.arrive_and_wait();
                times[i] = run(*renderers[i], poses, frames);
            });
        for (std::thread& thread : threads)
            thread.join();
        for (size_t i = 0; i < threads.size(); ++i)
            print(deviceText(renderers[i]->id()), times[i]);
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
