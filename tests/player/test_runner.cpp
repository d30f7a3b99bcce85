// SPDX-License-Identifier: Apache-2.0
// How a run is rendered and scored, with a renderer that tells what it was asked for.
#include "player/measure/runner.h"
#include "player/measure/work_facts.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace gsc;

namespace {

class NoScene final : public Scene {
public:
    [[nodiscard]] const ModelView& view() const override { return m_view; }
    [[nodiscard]] const std::string& manifest() const override { return m_manifest; }
    [[nodiscard]] const std::vector<SourceCamera>& cameras() const override { return m_cameras; }
    [[nodiscard]] int appearanceRow(int row) const override { return row; }
    [[nodiscard]] std::vector<uint32_t> appearanceRows() const override { return {}; }
    [[nodiscard]] uint64_t anchorCount() const override { return 1; }
    [[nodiscard]] uint64_t bytes() const override { return 1; }

private:
    ModelView m_view{};
    std::string m_manifest;
    std::vector<SourceCamera> m_cameras;
};

// A frame is grey: its camera's x, and with reuse 0.01 more for each frame since the caches were dropped. With foveation
// its first pixel is 0.1 more.
class GreyRenderer final : public Renderer {
public:
    struct Call {
        FrameOptions options;
        bool has_images;
        float x;
    };

    explicit GreyRenderer(bool on_host) : m_on_host(on_host) {}
    [[nodiscard]] DeviceId id() const override { return {}; }
    [[nodiscard]] DeviceFacts device() const override { return {}; }
    [[nodiscard]] bool onHost() const override { return m_on_host; }
    [[nodiscard]] Tier tierOf(Tier asked) const override { return asked; }
    using Renderer::load;
    void load(const ModelView&) override {}
    void dropCaches() override
    {
        m_age = 0;
        ++drops;
    }
    uint64_t submit(const FrameRequest& request) override
    {
        const EyeParams* eyes = request.eyes.data();
        calls.push_back({request.options, !request.targets.empty(), eyes[0].center[0]});
        const float off = request.options.reuse.policy == ReusePolicy::None ? 0 : 0.01f * float(m_age++);
        for (size_t e = 0; e < request.targets.size(); ++e) {
            auto* const pixels = static_cast<float*>(request.targets[e].pixels);
            std::fill_n(pixels, size_t(eyes[e].width) * eyes[e].height * 3, eyes[e].center[0] + off);
            if (request.options.foveation.smallest > 0)
                for (size_t c = 0; c < 3; ++c)
                    pixels[c] += 0.1f;
        }
        return calls.size();
    }
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds) override
    {
        result.eyes[0].anchors_decoded = ticket;
        return FrameState::Done;
    }

    std::vector<Call> calls;
    int drops = 0;

private:
    bool m_on_host;
    int m_age = 0;
};

// Frame i looks from x = 0.1 i.
Path greyPath(size_t frames)
{
    Path path;
    for (size_t i = 0; i < frames; ++i) {
        Shot shot;
        shot.camera.rotation[0] = shot.camera.rotation[4] = shot.camera.rotation[8] = 1;
        shot.camera.translation[0] = -0.1 * double(i);
        shot.camera.fov_x = shot.camera.fov_y = 1;
        shot.camera.width = shot.camera.height = 12;
        path.shots.push_back(shot);
    }
    return path;
}

FrameOptions reusing()
{
    FrameOptions options;
    options.reuse.policy = ReusePolicy::Error;
    options.lod_bias = -1;
    options.lod_fade = 0.5f;
    options.lod_hysteresis = 0.25f;
    options.near_z = 0.5f;
    return options;
}

// Errors 0, 0.01, 0.02 whatever came before the run.
void checkGreyRun(const RunResult& run)
{
    REQUIRE(run.accuracy.frame_psnr.size() == 3);
    CHECK(std::isinf(run.accuracy.frame_psnr[0]));
    CHECK(run.accuracy.frame_psnr[1] == doctest::Approx(40).epsilon(1e-4));
    CHECK(run.accuracy.max_error == doctest::Approx(0.02).epsilon(1e-4));
    CHECK(run.accuracy.temporal.max == doctest::Approx(0.01).epsilon(1e-3));
    CHECK(run.frames.size() == 3);
    CHECK(run.tier == Tier::Fast);
}

} // namespace

TEST_CASE("a renderer on the host: one pass, cold, exact images kept from before")
{
    const NoScene scene;
    const Path path = greyPath(3);
    GreyRenderer backend(true);
    ExactImages exact(scene, path, reusing(), {}, backend);
    uint64_t kept = 0;
    exact.keepAll([&](uint64_t shots) { kept = shots; });
    CHECK(kept == 3);
    REQUIRE(backend.calls.size() == 3);
    for (const GreyRenderer::Call& call : backend.calls) {
        CHECK(call.options.tier == Tier::Exact);
        CHECK(call.options.reuse.policy == ReusePolicy::None);
        CHECK(call.options.lod_bias == 0);
        CHECK(call.options.lod_fade == 0);
        CHECK(call.options.lod_hysteresis == 0);
        CHECK(call.options.near_z == 0.5f); // runs are compared as requested, not with another picture
    }
    std::vector<uint64_t> done;
    for (int again = 0; again < 2; ++again) {
        backend.calls.clear();
        done.clear();
        checkGreyRun(
            measureRun(scene, path, reusing(), backend, exact, {}, [&](uint64_t steps) { done.push_back(steps); }));
        CHECK(backend.drops == again + 1);
        REQUIRE(backend.calls.size() == 3);
        CHECK(backend.calls[2].has_images);
        CHECK(backend.calls[2].options.reuse.policy == ReusePolicy::Error);
        CHECK(backend.calls[2].options.lod_bias == -1);
        CHECK(backend.calls[2].options.lod_fade == 0.5f);
        CHECK(backend.calls[2].options.lod_hysteresis == 0.25f);
        CHECK(backend.calls[2].x == doctest::Approx(0.2));
        CHECK(done == std::vector<uint64_t>{1, 2, 3, 4, 5, 6}); // each frame is drawn, then scored
    }
}

TEST_CASE("a device: timed with images left there, then rendered again for the scores")
{
    const NoScene scene;
    const Path path = greyPath(3);
    GreyRenderer backend(false);
    ExactImages exact(scene, path, reusing(), {}, backend);
    exact.keepAll();
    backend.calls.clear();
    const RunResult run = measureRun(scene, path, reusing(), backend, exact, {}, [](uint64_t) {});
    checkGreyRun(run);
    REQUIRE(backend.calls.size() == 6);
    CHECK(backend.drops == 2);
    CHECK_FALSE(backend.calls[0].has_images);
    CHECK(backend.calls[3].has_images);
    CHECK(run.frames[2].result.eyes[0].anchors_decoded == 3); // counts are of the timed pass
}

TEST_CASE("with detail the frames between the scored ones are drawn too, and exact goes without")
{
    const NoScene scene;
    const Path path = greyPath(3);
    for (const float detail : {0.0f, 2.0f}) {
        GreyRenderer backend(false);
        FrameOptions options;
        options.detail = detail;
        const ScoreOptions last{{0, 2, {}}, 0, 0};
        CHECK(dependsOnPath(options) == (detail > 0));
        ExactImages exact(scene, path, options, last, backend);
        exact.keepAll();
        for (const GreyRenderer::Call& call : backend.calls)
            CHECK(call.options.detail == 0);
        backend.calls.clear();
        (void)measureRun(scene, path, options, backend, exact, last, [](uint64_t) {});
        CHECK(backend.calls.size() == (detail > 0 ? 6 : 5)); // timed, and drawn again for the scores
        CHECK(backend.calls[0].options.detail == detail);
    }
}

TEST_CASE("exact images that are not kept come from a backend of their own")
{
    const NoScene scene;
    const Path path = greyPath(3);
    GreyRenderer measured(true), other(true);
    ExactImages exact(scene, path, reusing(), {}, other);
    checkGreyRun(measureRun(scene, path, reusing(), measured, exact, {}, [](uint64_t) {}));
    CHECK(measured.calls.size() == 3);
    CHECK(other.calls.size() == 3);
    CHECK(other.drops == 0);
}

TEST_CASE("a long path is scored in blocks, each frame against its own pose")
{
    const NoScene scene;
    Path path = greyPath(5);
    for (Shot& shot : path.shots) // two frames to a block of 128 MiB
        shot.camera.width = shot.camera.height = 2000;
    path.shots.back().camera.width = 1000;
    GreyRenderer backend(true), other(true);
    ExactImages exact(scene, path, {}, {}, other);
    const RunResult run = measureRun(scene, path, {}, backend, exact, {}, [](uint64_t) {});
    CHECK(run.accuracy.images == 5);
    CHECK(run.accuracy.max_error == 0);
    CHECK(run.accuracy.temporal.images == 3); // the last has another size
    CHECK(backend.calls.size() == 5);
    CHECK(other.calls.size() == 5);
}

TEST_CASE("the median's range is of order statistics, and cameras that differ make it no wider")
{
    const auto timed = [](size_t count, auto ms_of) {
        std::vector<TimedFrame> frames(count);
        for (size_t i = 0; i < count; ++i)
            frames[i].wall_ms = ms_of(i);
        return frames;
    };
    const auto ascending = timed(100, [](size_t i) { return double(i * 37 % 100 + 1); }); // 1 to 100, mixed
    CHECK_FALSE(medianRange(std::span(ascending).first(5), 1));
    // one camera: 1.96 standard deviations of a binomial of 100 and 1/2 are 9.8 ranks
    const MedianRange one = *medianRange(ascending, 1);
    CHECK(one.low == 40);
    CHECK(one.high == 61);
    CHECK(percentOf(one, 50) == doctest::Approx(22));
    CHECK(percentOf(one, 0) == 0);
    // five frames each of 20 cameras, which take 1 to 20 ms: nothing but the camera makes a difference
    const auto cameras = timed(100, [](size_t i) { return double(i % 20 + 1); });
    const MedianRange same = *medianRange(cameras, 20), mixed = *medianRange(cameras, 1);
    CHECK(same.low == 9);
    CHECK(same.high == 12);
    CHECK(mixed.low == 8);
    CHECK(mixed.high == 13);
    const auto few = timed(8, [](size_t i) { return double(i); }); // more cameras than frames
    CHECK(medianRange(few, 100)->low <= 3);
}

TEST_CASE("exact images are of the frames that are scored, and take as much")
{
    Path path = greyPath(7);
    const uint64_t one = 12 * 12 * 3 * sizeof(float);
    CHECK(ExactImages::bytes(path, {}) == 7 * one);
    CHECK(ExactImages::bytes(path, {{2, 3, {}}, 0, 0}) == 2 * one); // frames 2 and 5
    path.eye_count = 2;
    CHECK(ExactImages::bytes(path, {{2, 3, {}}, 0, 0}) == 4 * one);
    const NoScene scene;
    GreyRenderer backend(true);
    ExactImages exact(scene, path, {}, {{2, 3, {}}, 0, 0}, backend);
    exact.keepAll();
    CHECK(backend.calls.size() == 2);
    CHECK(backend.calls[1].x == doctest::Approx(0.5));
}

TEST_CASE("every third frame from the second on is scored, all are timed, and what a frame depends on is drawn")
{
    const NoScene scene;
    const Path path = greyPath(8);
    const ScoreOptions score{{1, 3, {}}, 2, 0}; // SSIM of every second one
    for (const bool on_host : {true, false})
        for (const FrameOptions& options : {reusing(), FrameOptions{}}) {
            CAPTURE(on_host);
            GreyRenderer backend(on_host), other(true);
            ExactImages exact(scene, path, options, score, other);
            std::vector<uint64_t> done;
            const RunResult run =
                measureRun(scene, path, options, backend, exact, score, [&](uint64_t steps) { done.push_back(steps); });
            CHECK(run.frames.size() == 8);
            CHECK(done.size() == kStepsOfFrame * 8);
            CHECK(other.calls.size() == 3);
            const Accuracy& a = run.accuracy;
            CHECK(a.images == 3);
            REQUIRE(a.frame_psnr.size() == 3); // frames 1, 4 and 7
            CHECK(a.scored.frameOf(2) == 7);
            CHECK(a.ssim.frames == 2);
            CHECK(a.temporal.images == 0); // nothing is known of the frames between
            CHECK(a.pop.images == 0);
            const bool reuses = options.reuse.policy != ReusePolicy::None;
            CHECK(a.max_error ==
                  doctest::Approx(reuses ? 0.07 : 0).epsilon(1e-4)); // in frame 7, the eighth since the start
            CHECK((a.psnr_min_frame == (reuses ? 7 : 1)));
            CHECK(backend.calls.size() == (on_host ? 8 : reuses ? 16 : 11));
        }
}

TEST_CASE("with foveation the exact images have none, and what lies within and around the fovea is told")
{
    const NoScene scene;
    const Path path = greyPath(2); // 12 x 12 pixels of 4.7 degrees and less
    for (const bool on_host : {true, false}) {
        GreyRenderer backend(on_host), reference(true);
        FrameOptions options;
        options.foveation.smallest = 2;
        ExactImages exact(scene, path, options, {}, reference);
        const RunResult run = measureRun(scene, path, options, backend, exact, {{}, 0, 1}, [](uint64_t) {});
        CHECK(backend.calls.back().options.foveation.smallest == 2);
        for (const GreyRenderer::Call& call : reference.calls)
            CHECK(call.options.foveation.smallest == 0);
        REQUIRE(run.accuracy.fovea);
        const FoveaAccuracy& fovea = *run.accuracy.fovea;
        // the middles of 16 pixels lie within 12 degrees: 0.0911 n at depth 1, n half an odd number, up to 0.2126
        CHECK(fovea.inside.share == doctest::Approx(16.0 / 144));
        CHECK(std::isinf(fovea.inside.psnr_min));
        CHECK(fovea.outside.psnr_pooled == doctest::Approx(-10 * std::log10(0.01 / 128)).epsilon(1e-4));
        CHECK(fovea.outside.psnr_min == doctest::Approx(fovea.outside.psnr_pooled).epsilon(1e-4));
        CHECK(fovea.outside.flip > 0);
        CHECK(fovea.outside.flip > fovea.inside.flip);
        options.foveation = {};
        CHECK_FALSE(measureRun(scene, path, options, backend, exact, {}, [](uint64_t) {}).accuracy.fovea);
    }
}
