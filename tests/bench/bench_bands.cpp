// SPDX-License-Identifier: Apache-2.0
// Cost of a band of an image as a share of the whole's, at 2, 4 and 8 bands: the share of the anchors that are decoded,
// of the Gaussians on screen and of the time, in the mean over the bands and of the band that takes most. First of
// bands of about the same width, then where a renderer service cuts: balanced by what bands of the same picture took
// before. The band that takes most is what so many devices would wait for.
//
//   bench_bands FILE.gsc [size = 1024] [frames = 20] [backend = cpu] [horizontal angle = 90]
//
// Two eyes of size x size at the file's cameras, evenly spread over them. Times are the device's, the least of two draws.
#include "runtime/cameras/camera_file.h"
#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include <gsc/renderer.h>
#include "runtime/service/policy/bands.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

using namespace gsc;

namespace {

struct Pose {
    EyeParams eyes[kMaxEyes];
    FrameOptions options;
};

struct Cost {
    double anchors = 0, gaussians = 0, ms = 0; // decoded anchors and Gaussians on screen, of both eyes
    StageTimes stages;

    void add(const Cost& other)
    {
        anchors += other.anchors;
        gaussians += other.gaussians;
        ms += other.ms;
        stages.add(other.stages);
    }
};

Cost costOf(Renderer& renderer, const Pose& pose)
{
    Cost cost;
    for (int i = 0; i < 2; ++i) {
        const FrameResult result = render(renderer, {pose.eyes, {}, pose.options});
        cost.anchors = double(result.eyes[0].anchors_decoded + result.eyes[1].anchors_decoded);
        cost.gaussians = double(result.eyes[0].gaussians_visible + result.eyes[1].gaussians_visible);
        if (i == 0 || result.times.total < cost.ms) {
            cost.ms = result.times.total;
            cost.stages = result.times;
        }
    }
    return cost;
}

std::vector<ColumnRange> equalBands(uint32_t size, uint32_t count)
{
    std::vector<ColumnRange> bands;
    for (uint32_t b = 0; b < count; ++b)
        bands.push_back(
            {size * b / count / kColumnStep * kColumnStep, size * (b + 1) / count / kColumnStep * kColumnStep});
    return bands;
}

// After some looks at the same pose, as a service has them at the poses before.
std::vector<ColumnRange> balancedBands(Renderer& renderer, Pose pose, uint32_t size, uint32_t count)
{
    constexpr int kLooks = 8;
    BandBalance balance;
    for (int look = 0; look < kLooks; ++look) {
        const std::vector<ColumnRange> bands = balance.cut(size, count);
        std::vector<double> ms;
        for (const ColumnRange& band : bands) {
            pose.options.columns = band;
            ms.push_back(costOf(renderer, pose).ms);
        }
        balance.learn(size, bands, ms);
    }
    return balance.cut(size, count);
}

void measure(Renderer& renderer, std::vector<Pose> poses, uint32_t size, uint32_t count, bool balanced,
             const Cost& whole)
{
    Cost all, most;
    size_t bands = 0;
    for (Pose& pose : poses) {
        Cost largest;
        for (const ColumnRange& band :
             balanced ? balancedBands(renderer, pose, size, count) : equalBands(size, count)) {
            ++bands;
            pose.options.columns = band;
            const Cost cost = costOf(renderer, pose);
            all.add(cost);
            largest.anchors = std::max(largest.anchors, cost.anchors);
            largest.gaussians = std::max(largest.gaussians, cost.gaussians);
            largest.ms = std::max(largest.ms, cost.ms);
        }
        most.add(largest);
    }
    const auto percent = [&](double Cost::*value, const Cost& of, double parts) {
        return 100 * of.*value / parts / (whole.*value);
    };
    const double mean = double(bands) / double(poses.size());
    std::printf(
        "%u bands, %s: anchors decoded %5.1f %% (most %5.1f), Gaussians %5.1f %% (%5.1f), time %5.1f %% (%5.1f)\n",
        count, balanced ? "balanced" : "equal   ", percent(&Cost::anchors, all, mean), percent(&Cost::anchors, most, 1),
        percent(&Cost::gaussians, all, mean), percent(&Cost::gaussians, most, 1), percent(&Cost::ms, all, mean),
        percent(&Cost::ms, most, 1));
    const StageTimes &part = all.stages, &of = whole.stages;
    const auto share = [&](double a, double b) { return b > 0 ? 100 * a / mean / b : 0.0; };
    std::printf("    of the whole's select %.1f %%, decode %.1f, bin %.1f, sort %.1f, blend %.1f\n",
                share(part.select, of.select), share(part.decode + part.project, of.decode + of.project),
                share(part.bin, of.bin), share(part.sort, of.sort), share(part.blend, of.blend));
}

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2)
        return 2;
    try {
        const auto size = uint32_t(argc > 2 ? std::atoi(argv[2]) : 1024);
        const auto frames = size_t(argc > 3 ? std::atoi(argv[3]) : 20);
        const std::shared_ptr<const Scene> scene = Scene::open(argv[1]);
        PlayOptions options;
        options.model.file = argv[1];
        options.view.eyes = 2;
        options.view.width = options.view.height = size;
        options.view.fov_x = (argc > 5 ? std::atof(argv[5]) : 90) * std::numbers::pi / 180;
        Reporter log({.quiet = true});
        const std::vector<Shot> shots = chooseShots(*scene, options.model.file, options.cameras, options.view, log);
        std::vector<Pose> poses;
        for (size_t i = 0; i < std::min(frames, shots.size()); ++i) {
            const Shot& shot = shots[i * shots.size() / std::min(frames, shots.size())];
            Pose& pose = poses.emplace_back();
            shotEyes(shot, 2, pose.eyes);
            pose.options = frameOptions(*scene, options.frame);
            pose.options.appearance = shotAppearance(*scene, shot);
        }
        const std::unique_ptr<Renderer> renderer = makeRenderer({argc > 4 ? argv[4] : "cpu", 0});
        renderer->load(scene);
        Cost whole;
        for (const Pose& pose : poses)
            whole.add(costOf(*renderer, pose));
        const auto n = double(poses.size());
        const StageTimes& t = whole.stages;
        std::printf("whole: %.0f anchors decoded, %.0f Gaussians, %.2f ms a frame: select %.2f, decode %.2f, bin %.2f, "
                    "sort %.2f, blend %.2f\n",
                    whole.anchors / n, whole.gaussians / n, whole.ms / n, t.select / n, (t.decode + t.project) / n,
                    t.bin / n, t.sort / n, t.blend / n);
        for (const uint32_t count : {2u, 4u, 8u})
            for (const bool balanced : {false, true})
                measure(*renderer, poses, size, count, balanced, whole);
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
