// SPDX-License-Identifier: Apache-2.0
// Decode time of a real model along a path, with reuse by error over without, in one process, the path in turns; and
// that of decode and project together, which drawing what is kept shares the machine's memory with.
//   bench_reuse FILE.gsc PATH.json FRAMES ROUNDS [BOUND [THREADS]]
// Draws the first FRAMES frames at 640x480. BOUND is in 1/255 (default 1), THREADS 1 by default. Every round starts
// from nothing kept; per frame
// the least of the rounds counts, which other work on the machine disturbs least. The first kWarmup frames, where all
// is new, do not count.
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cpu/renderer_cpu.h"
#include <gsc/camera.h>
#include <gsc/scene.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

using namespace gsc;

namespace {

constexpr size_t kWarmup = 5;

struct Turn {
    std::unique_ptr<Renderer> backend;
    FrameOptions options;
    std::vector<double> least_ms, least_both_ms; // per frame: decode, and with project
    uint64_t decoded = 0, visible = 0;
};

Turn makeTurn(const Scene& scene, ReusePolicy policy, float bound, int threads)
{
    Turn turn;
    turn.backend = makeCpuRenderer(CpuPath::Fast, threads);
    turn.backend->load(scene.view());
    turn.options.reuse.policy = policy;
    turn.options.reuse.bound = bound;
    turn.options.appearance = scene.appearanceRows().empty() ? -1 : 0;
    return turn;
}

void drawFrame(Turn& turn, const EyeParams& eye, size_t frame)
{
    const FrameResult result = render(*turn.backend, {&eye, 1}, turn.options);
    turn.least_ms[frame] = std::min(turn.least_ms[frame], result.times.decode);
    turn.least_both_ms[frame] = std::min(turn.least_both_ms[frame], result.times.decode + result.times.project);
    if (frame < kWarmup)
        return;
    turn.decoded += result.eyes[0].anchors_decoded;
    turn.visible += result.eyes[0].anchors_visible;
}

double mean(const std::vector<double>& ms)
{
    double sum = 0;
    for (size_t i = kWarmup; i < ms.size(); ++i)
        sum += ms[i];
    return sum / double(ms.size() - kWarmup);
}

int benchmark(int argc, char** argv)
{
    if (argc < 5 || argc > 7)
        throw Error(ErrorCode::Usage, "bench_reuse", "other words",
                    "FILE.gsc PATH.json FRAMES ROUNDS [BOUND [THREADS]]", "pass these");
    const auto frames = size_t(std::atoi(argv[3]));
    const int rounds = std::atoi(argv[4]), threads = argc > 6 ? std::atoi(argv[6]) : 1;
    const float bound = argc > 5 ? float(std::atof(argv[5])) : 1.0f;
    const std::unique_ptr<Scene> scene = Scene::open(argv[1]);
    std::vector<EyeParams> eyes;
    for (Camera camera : readCameraFile(argv[2])) {
        if (eyes.size() == frames)
            break;
        finishCamera(camera, 640, 480, 0);
        eyes.push_back(eyeParams(camera, scene->view().origin));
    }
    if (eyes.size() <= kWarmup || rounds < 1)
        throw Error(ErrorCode::Usage, "bench_reuse", "too few", "more than 5 frames and a round or more", "pass these");
    Turn turns[2] = {makeTurn(*scene, ReusePolicy::None, bound, threads),
                     makeTurn(*scene, ReusePolicy::Error, bound, threads)};
    for (Turn& turn : turns) {
        turn.least_ms.assign(eyes.size(), 1e30);
        turn.least_both_ms.assign(eyes.size(), 1e30);
    }
    for (int round = 0; round < rounds; ++round)
        for (Turn& turn : turns) {
            turn.backend->dropCaches();
            for (size_t i = 0; i < eyes.size(); ++i)
                drawFrame(turn, eyes[i], i);
        }
    const double none = mean(turns[0].least_ms), error = mean(turns[1].least_ms);
    const double none_both = mean(turns[0].least_both_ms), error_both = mean(turns[1].least_both_ms);
    std::printf(
        "decode: %zu frames, %.0f anchors visible, %.3f ms without reuse, %.3f ms with (%.3f), %.1f %% decoded; "
        "and project: %.3f, %.3f ms (%.3f)\n",
        eyes.size() - kWarmup, double(turns[1].visible) / double(rounds * (eyes.size() - kWarmup)), none, error,
        error / none, 100 * double(turns[1].decoded) / double(turns[1].visible), none_both, error_both,
        error_both / none_both);
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    try {
        return benchmark(argc, argv);
    } catch (const Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
