// SPDX-License-Identifier: Apache-2.0
// A frame's launches are captured once and used again with other eyes: every frame must come out as from a new backend.
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Job {
    std::vector<EyeParams> eyes;
    FrameOptions options;
};

std::vector<Job> variousJobs()
{
    std::vector<Job> jobs;
    for (const Tier tier : {Tier::Fast, Tier::Exact}) {
        for (const float x : {-0.6f, 0.1f, 0.8f}) // one graph
            jobs.push_back({{eyeAt(x, -5, 150, 110), eyeAt(x + 0.1f, -5, 150, 110)}, onGrey(tier)});
        jobs.push_back({{eyeAt(0.3f, -5, 150, 110)}, onGrey(tier)});
        jobs.push_back({{eyeAt(0.3f, -5, 310, 60), eyeAt(0.5f, -4, 70, 150)}, onGrey(tier)});
        jobs.push_back({{eyeAt(0.3f, -5, 70, 150), eyeAt(0.5f, -4, 310, 60)}, onGrey(tier)});
        Job other = jobs.back();
        other.options.near_z = 2;
        jobs.push_back(other);
        other.options.lod_bias = -1.2f;
        jobs.push_back(other);
        other.options.lod_bias = -0.4f; // the same graph
        jobs.push_back(other);
        other.options.lod_fade = 0.5f; // has factors
        jobs.push_back(other);
        other.options.lod_fade = 0.25f; // the same graph
        jobs.push_back(other);
        other.options.background[1] = 0.25f;
        jobs.push_back(other);
        other.options.appearance = 1;
        jobs.push_back(other);
    }
    for (size_t i = 0; i < jobs.size(); ++i)
        if (jobs[i].options.appearance < 0)
            jobs[i].options.appearance = 0;
    return jobs;
}

} // namespace

TEST_CASE("frames of many shapes in any order, more of them than graphs are kept")
{
    SyntheticOptions options = octree(LevelRule::Round, 1500, 1);
    options.inputs = kMlpTakesAppearance | kMlpTakesLevel;
    options.appearance_dim = 8;
    options.appearance_rows = 2;
    const SyntheticModel model(options);
    options.seed = 2;
    const SyntheticModel second(options);
    const std::vector<Job> jobs = variousJobs();
    std::vector<std::vector<Image<float>>> wanted;
    for (const Job& job : jobs) {
        const auto fresh = open(model.view());
        wanted.push_back(render(*fresh, job.eyes, job.options));
    }
    CHECK(!sameBytes(wanted[0], wanted[1]));
    const auto gpu = open(model.view());
    Random random(3);
    for (uint32_t turn = 0; turn < 40; ++turn) {
        const auto j = size_t(random.uniform() * float(jobs.size()));
        CAPTURE(turn);
        CAPTURE(j);
        CHECK(sameBytes(render(*gpu, jobs[j].eyes, jobs[j].options), wanted[j]));
        if (turn % 20 == 10) { // another model in between
            gpu->load(second.view());
            CHECK(!sameBytes(render(*gpu, jobs[j].eyes, jobs[j].options), wanted[j]));
            gpu->load(model.view());
        }
    }
}

TEST_CASE("levels that lag behind the camera see what they see on a CPU, and forget it when told to")
{
    const SyntheticModel model(octree(LevelRule::Round, 1500, 1));
    const std::unique_ptr<Renderer> gpu = makeRenderer({"cuda"}), cpu = makeRenderer({"cpu"}, {1});
    gpu->load(model.view());
    cpu->load(model.view());
    FrameOptions frame = onGrey(Tier::Exact), plain = frame;
    frame.lod_hysteresis = 0.5f;
    uint32_t lagged = 0;
    for (const float x : {0.0f, 0.5f, 1.0f, 0.6f, 0.2f, -0.5f, 0.1f}) {
        const std::vector<EyeParams> eyes = {eyeAt(x, -5 + x, 90, 70), eyeAt(x + 0.1f, -5 + x, 90, 70)};
        const auto on_gpu = render(*gpu, eyes, frame), on_cpu = render(*cpu, eyes, frame);
        const auto fresh = open(model.view(), "cpu");
        const auto upstream = render(*fresh, eyes, plain);
        for (size_t e = 0; e < 2; ++e) {
            const uint64_t seen = on_gpu[e].result.eyes[e].anchors_visible;
            CHECK(seen == on_cpu[e].result.eyes[e].anchors_visible);
            lagged += seen != upstream[e].result.eyes[e].anchors_visible;
        }
        if (x == -0.5f) {
            gpu->dropCaches();
            CHECK(render(*gpu, eyes, frame)[0].result.eyes[0].anchors_visible ==
                  upstream[0].result.eyes[0].anchors_visible);
            cpu->dropCaches();
            (void)render(*cpu, eyes, frame);
        }
    }
    CHECK(lagged >= 4);
}
