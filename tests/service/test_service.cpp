// SPDX-License-Identifier: Apache-2.0
// A renderer service with several renderers on the host: the same bytes as one renderer in every mode, order, rates.
#include "runtime/service/pose_work.h"
#include "runtime/service/service_renderer.h"
#include "tests/service/service_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

using namespace gsc;
using namespace gsc::test;

namespace {

using namespace std::chrono_literals;

// Draws nothing, and takes so many microseconds for it, whatever the machine.
using FrameTime = std::function<int(const FrameRequest&)>;
class SleepingRenderer final : public Renderer {
public:
    explicit SleepingRenderer(FrameTime us) : m_us(std::move(us)) {}

    [[nodiscard]] DeviceId id() const override { return {"cpu"}; }
    [[nodiscard]] DeviceFacts device() const override { return {}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; }
    using Renderer::load;
    void load(const ModelView&) override {}
    void dropCaches() override {}
    uint64_t submit(const FrameRequest& request) override
    {
        m_times[++m_ticket] = m_us(request);
        return m_ticket;
    }
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds) override
    {
        std::this_thread::sleep_for(std::chrono::microseconds(m_times.extract(ticket).mapped()));
        result = {};
        result.eyes[0].gaussians_visible = 1;
        return FrameState::Done;
    }

private:
    FrameTime m_us;
    std::map<uint64_t, int> m_times; // times of frames in flight
    uint64_t m_ticket = 0;
};

MakeRenderer sleepingRenderers(FrameTime us)
{
    return [us = std::move(us)](const DeviceId&, const RendererOptions&) -> std::unique_ptr<Renderer> {
        return std::make_unique<SleepingRenderer>(us);
    };
}

// Waits until `holds`, for 20 s at most.
template <typename Holds>
bool comesTrue(const Holds& holds)
{
    for (const auto end = std::chrono::steady_clock::now() + 20s; std::chrono::steady_clock::now() < end;) {
        if (holds())
            return true;
        std::this_thread::sleep_for(2ms);
    }
    return false;
}

} // namespace

TEST_CASE("every mode and number of workers delivers the bytes of one renderer, in order")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto one = open(model.view());
    constexpr int kPoses = 10;
    for (const size_t eyes : {1, 2})
        for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged}) {
            FrameOptions options = with(ReusePolicy::None);
            options.tier = Tier::Exact;
            options.stereo = stereo;
            std::vector<std::vector<unsigned char>> expected;
            for (int i = 0; i < kPoses; ++i)
                expected.push_back(expectedBytes(*one, i, eyes, options));
            for (const ServiceMode mode : {ServiceMode::Frame, ServiceMode::Eye, ServiceMode::Split, ServiceMode::Auto})
                for (const size_t workers : {1, 2, 3}) {
                    if (mode == ServiceMode::Eye && stereo == StereoMode::Merged)
                        continue;
                    CAPTURE(eyes);
                    CAPTURE(serviceModeName(mode));
                    CAPTURE(workers);
                    RendererService service(model.view(), cpuWorkers(workers, mode));
                    for (int i = 0; i < kPoses; ++i)
                        submitWalk(service, i, eyes, options);
                    for (int i = 0; i < kPoses; ++i) {
                        const std::optional<Delivery> delivery = service.next();
                        REQUIRE(delivery);
                        CHECK(delivery->pose == uint64_t(i + 1));
                        REQUIRE(delivery->end == PoseEnd::Shown);
                        CHECK(bytesOf(*delivery, i, eyes) == expected[size_t(i)]);
                        CHECK(delivery->result.eyes[0].gaussians_visible > 0);
                        CHECK(delivery->result.eyes[eyes - 1].blend_evaluations > 0);
                    }
                    CHECK_FALSE(service.next());
                    CHECK(service.stats().counts.of(PoseEnd::Shown) == kPoses);
                }
        }
}

TEST_CASE("eyes that are looked up late are drawn, the same by all workers of a pose")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto one = open(model.view());
    FrameOptions options = with(ReusePolicy::None);
    options.tier = Tier::Exact;
    const std::vector<unsigned char> early = expectedBytes(*one, 0, 2, options),
                                     late = expectedBytes(*one, 3, 2, options);
    REQUIRE(early != late);
    for (const ServiceMode mode : {ServiceMode::Frame, ServiceMode::Eye, ServiceMode::Split})
        for (const bool larger : {false, true}) { // than what there is memory for: the eyes stay
            CAPTURE(serviceModeName(mode));
            RendererService service(model.view(), cpuWorkers(2, mode));
            std::atomic<int> looks{0};
            const std::vector<EyeParams> first = walk(0, 2), then = walk(3, 2);
            PoseRequest request;
            request.eyes = first;
            request.options = options;
            request.late = [&](std::span<EyeParams> eyes) {
                ++looks;
                std::ranges::copy(then, eyes.begin());
                eyes[1].width += larger ? 32 : 0;
                return true;
            };
            service.submit(request);
            const std::optional<Delivery> delivery = service.next();
            REQUIRE(delivery);
            REQUIRE(delivery->end == PoseEnd::Shown);
            CHECK(bytesOf(*delivery, 0, 2) == (larger ? early : late));
            CHECK(looks == 1);
        }
}

TEST_CASE("merged eyes are not shared between workers")
{
    const SyntheticModel model(modelOptions());
    RendererService service(model.view(), cpuWorkers(2, ServiceMode::Eye));
    FrameOptions options;
    options.stereo = StereoMode::Merged;
    CHECK_THROWS_AS(submitWalk(service, 0, 2, options), Error);
    CHECK_NOTHROW(submitWalk(service, 0, 1, options));
}

TEST_CASE("an empty picture is black in bands too, and without that rule has its background")
{
    const SyntheticModel model(modelOptions());
    const auto one = open(model.view());
    for (const bool black : {true, false}) {
        RendererService service(model.view(), cpuWorkers(2, ServiceMode::Split));
        std::vector<EyeParams> eyes = walk(0, 2);
        for (EyeParams& eye : eyes)
            eye.world_to_view[11] -= 1000; // all lies behind
        PoseRequest request;
        request.options = with(ReusePolicy::None);
        request.options.empty_is_black = black;
        request.eyes = eyes;
        request.format = PixelFormat::Rgb32f;
        service.submit(request);
        const auto delivery = service.next();
        REQUIRE(delivery);
        const auto* const pixels = static_cast<const float*>(delivery->eyes[1].pixels);
        const std::vector<float> wanted = render(*one, eyes, request.options)[1].pixels;
        CHECK(wanted[0] == (black ? 0.0f : 0.5f));
        CHECK(std::equal(wanted.begin(), wanted.end(), pixels));
    }
}

TEST_CASE("depths come with the pictures")
{
    const SyntheticModel model(modelOptions());
    const auto one = open(model.view());
    std::vector<std::vector<float>> pictures;
    const std::vector<EyeParams> eyes = walk(0, 2);
    const auto wanted = renderDepths(*one, eyes, FrameOptions{}, pictures);
    for (const ServiceMode mode : {ServiceMode::Eye, ServiceMode::Split}) {
        RendererService service(model.view(), cpuWorkers(2, mode));
        PoseRequest request;
        request.eyes = eyes;
        request.wants_depth = true;
        service.submit(request);
        const auto delivery = service.next();
        REQUIRE(delivery);
        for (size_t e = 0; e < 2; ++e)
            CHECK(std::equal(wanted[e].begin(), wanted[e].end(), delivery->eyes[e].depth));
    }
}

TEST_CASE("an eye that a worker draws alone has its own lens and gaze, and another lens is another pose")
{
    const SyntheticModel model(modelOptions());
    const std::vector<EyeParams> eyes = walk(0, 2);
    std::mutex mutex;
    std::vector<FrameOptions> drawn; // options of the second eye alone
    ServiceOptions options = cpuWorkers(2, ServiceMode::Eye);
    options.still_distance = options.still_degrees = 1e-6;
    options.make = sleepingRenderers([&](const FrameRequest& request) {
        const std::lock_guard lock(mutex);
        if (request.eyes.size() == 1 && request.eyes[0].center[0] == eyes[1].center[0])
            drawn.push_back(request.options);
        return 0;
    });
    RendererService service(model.view(), options);
    PoseRequest request;
    request.eyes = eyes;
    request.options.lens[1].masks = true;
    request.options.lens[1].first[3] = 7;
    request.options.foveation.gaze[1][0] = 0.25f;
    const uint64_t first = service.submit(request);
    CHECK(service.submit(request) == first);
    request.options.lens[1].end[3] = 9;
    const uint64_t second = service.submit(request);
    CHECK(second != first);
    while (service.next()) {
    }
    const std::lock_guard lock(mutex);
    REQUIRE(drawn.size() == 2);
    std::ranges::sort(drawn, {}, [](const FrameOptions& frame) { return frame.lens[0].end[3]; });
    for (const FrameOptions& frame : drawn) {
        CHECK(frame.lens[0].masks);
        CHECK(frame.lens[0].first[3] == 7);
        CHECK(frame.foveation.gaze[0][0] == 0.25f);
    }
    CHECK(drawn[0].lens[0].end[3] == 0);
    CHECK(drawn[1].lens[0].end[3] == 9);
}

TEST_CASE("a viewer is shown the newest pose; a pose that has not moved is not drawn again")
{
    const SyntheticModel model(modelOptions());
    std::atomic<int> us = 3000;
    ServiceOptions options = cpuWorkers(2, ServiceMode::Frame);
    options.keeps_all = false;
    options.timeout = 20ms;
    options.still_distance = options.still_degrees = 1e-6;
    options.make = sleepingRenderers([&us](const FrameRequest&) { return us.load(); });
    RendererService service(model.view(), options);
    uint64_t shown = 0;
    for (int i = 0; i < 150; ++i) {
        const uint64_t pose = submitWalk(service, i, 2, FrameOptions{});
        CHECK(submitWalk(service, i, 2, FrameOptions{}) == pose);
        while (i % 5 == 4) { // poses come faster than pictures
            const auto delivery = service.next(1ms);
            if (!delivery)
                break;
            CHECK(delivery->pose > shown);
            shown = delivery->pose;
        }
    }
    while (const auto delivery = service.next())
        shown = delivery->pose;
    const ServiceStats stats = service.stats();
    CHECK(stats.counts.submitted == 150);
    CHECK(stats.still == 150);
    CHECK(stats.counts.open() == 0);
    CHECK(stats.counts.of(PoseEnd::Shown) > 10);
    CHECK(stats.counts.of(PoseEnd::Expired) > 10);
    CHECK(stats.counts.of(PoseEnd::Failed) == 0);
}

TEST_CASE("workers start and stop with the rate, warm ones without loading again")
{
    const SyntheticModel model(modelOptions());
    std::atomic<int> us = 4000;
    ServiceOptions options = cpuWorkers(2, ServiceMode::Frame);
    options.keeps_all = false;
    options.pace.min_fps = 25; // far from what the workers do: a machine that stalls for a while changes nothing
    options.pace.max_fps = 60;
    options.pace.stop_after = 100ms;
    options.trace_limit = 1000;
    options.make = sleepingRenderers([&us](const FrameRequest&) { return us.load(); });
    RendererService service(model.view(), options);
    std::atomic<bool> ends = false;
    std::thread viewer([&] {
        for (int i = 0; !ends; ++i) {
            submitWalk(service, i % 50, 1, FrameOptions{});
            while (service.next(5ms)) {
            }
        }
    });
    const auto working = [&](uint32_t count) { return [&service, count] { return service.stats().working == count; }; };
    CHECK(comesTrue(working(1)));
    us = 60000; // 17 of one, 33 of two
    CHECK(comesTrue(working(2)));
    us = 2000; // 500 of one: above (1 + 1/1) of 60
    CHECK(comesTrue(working(1)));
    ends = true;
    viewer.join();
    const ServiceStats stats = service.stats();
    CHECK(stats.workers[1].starts == 1);
    CHECK(stats.workers[1].stops == 1);
    CHECK(stats.workers[1].state == WorkerState::Warm);
    const ServiceTrace trace = service.trace();
    size_t ready = 0, causes = 0;
    for (const TraceEvent& event : trace.events) {
        ready += event.kind == TraceEvent::Kind::Ready;
        causes +=
            (event.kind == TraceEvent::Kind::Start || event.kind == TraceEvent::Kind::Stop) && !event.cause.empty();
    }
    CHECK(ready == 2); // it never loaded twice
    CHECK(causes == 3);
    CHECK_FALSE(trace.poses.empty());
}

TEST_CASE("a plan that is only tried, and draws too few frames, starts no worker")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = cpuWorkers(3, ServiceMode::Auto);
    options.keeps_all = false;
    options.pace.min_fps = 18; // one worker draws 12.5, two 25 in turn, 16 by an eye each
    options.make = sleepingRenderers([](const FrameRequest& request) {
        return !request.options.columns.all() ? 45000 : request.eyes.size() == 1 ? 62000 : 80000;
    });
    RendererService service(model.view(), options);
    const auto end = std::chrono::steady_clock::now() + 3s;
    for (int i = 0; std::chrono::steady_clock::now() < end; ++i) {
        submitWalk(service, i % 50, 2, FrameOptions{});
        (void)service.next(10ms);
    }
    const ServiceStats stats = service.stats();
    CHECK(stats.workers[1].starts == 1);
    CHECK(stats.workers[2].starts == 0);
    CHECK(stats.working == 2);
    CHECK(stats.workers[1].parts > 10);
}

TEST_CASE("detail is another kind of pose: how it is shared is tried anew, and not again as detail changes")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = cpuWorkers(2, ServiceMode::Auto);
    options.trace_limit = 1000;
    std::vector<bool> unlimited;
    options.make = [&unlimited, make = sleepingRenderers([](const FrameRequest&) { return 0; }),
                    mutex = std::make_shared<std::mutex>()](const DeviceId& device, const RendererOptions& limits) {
        const std::lock_guard lock(*mutex);
        unlimited.push_back(limits.coarse_unlimited);
        return make(device, limits);
    };
    RendererService service(model.view(), options);
    const auto tries = [&service] {
        return std::ranges::count_if(service.trace().events,
                                     [](const TraceEvent& event) { return event.cause.starts_with("tries all"); });
    };
    FrameOptions frame;
    for (const auto& [detail, tried] : {std::pair(0.0f, 1), {2.0f, 2}, {2.5f, 2}, {0.0f, 3}}) {
        frame.detail = detail;
        submitWalk(service, 0, 2, frame);
        REQUIRE(service.next());
        CHECK(tries() == tried);
    }
    CHECK(unlimited == std::vector{true, true});
}

TEST_CASE("frames with detail teach nothing until copies have been made, nor do those after detail was off")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = cpuWorkers(1, ServiceMode::Frame);
    options.make = sleepingRenderers([](const FrameRequest&) { return 100; });
    RendererService service(model.view(), options);
    const auto draws = [&](float detail, int poses) {
        FrameOptions frame;
        frame.detail = detail;
        for (int i = 0; i < poses; ++i) {
            submitWalk(service, i, 1, frame);
            REQUIRE(service.next());
        }
        return service.stats().rate;
    };
    CHECK(draws(2, 16) == 0);
    const double rate = draws(2, 4);
    CHECK(rate > 0);
    CHECK(draws(0, 8) != rate);
    const double without = service.stats().rate;
    CHECK(draws(2, 16) == without);
    CHECK(draws(2, 4) != without);
}

TEST_CASE("groups of all parts of a pose are counted")
{
    PoseRequest request;
    request.eyes = walk(0, 2);
    PoseWork work(request);
    work.setParts({{1, {}, 0}, {2, {}, 1}});
    work.parts[0].result.coarse = {1, 2, 3, 4};
    work.parts[1].result.coarse = {10, 20, 30, 40};
    const CoarseCounts all = work.result().coarse;
    CHECK(all.near == 11);
    CHECK(all.kept == 22);
    CHECK(all.stale == 33);
    CHECK(all.made == 44);
}

TEST_CASE("a service is a renderer: tickets in any order, caller's memory, what cannot be drawn")
{
    const SyntheticModel model(modelOptions());
    const auto one = open(model.view());
    ServiceOptions service_options = cpuWorkers(2, ServiceMode::Frame);
    service_options.still_distance = service_options.still_degrees = 1; // limits for viewers: here every frame is drawn
    service_options.timeout = 1ms;
    const auto shared = makeServiceRenderer(service_options);
    CHECK_THROWS_AS((void)shared->device(), Error);
    CHECK_THROWS_AS(shared->dropCaches(), Error);
    shared->load(model.view());
    CHECK(shared->id() == DeviceId{"cpu"});
    CHECK(shared->onHost());
    const std::vector<EyeParams> eyes = walk(0, 2);
    const auto wanted = render(*one, eyes, FrameOptions{});
    CHECK(render(*shared, eyes, FrameOptions{})[1].pixels == wanted[1].pixels);
    std::vector<float> padded(size_t(eyes[0].width + 5) * 3 * eyes[0].height, -7.0f);
    FrameTarget target = hostTarget(padded.data());
    target.pitch = (eyes[0].width + 5) * size_t(12);
    const uint64_t first = shared->submit({{eyes.data(), 1}, {&target, 1}, {}}),
                   second = shared->submit({eyes, {}, {}});
    FrameResult result;
    CHECK(shared->wait(second, result) == FrameState::Done);
    CHECK(shared->wait(first, result) == FrameState::Done);
    CHECK(std::equal(wanted[0].pixels.begin(), wanted[0].pixels.begin() + 3 * eyes[0].width, padded.begin()));
    CHECK(padded[3 * eyes[0].width] == -7);
    CHECK_THROWS_AS((void)shared->wait(first, result), Error);
    FrameOptions bad;
    bad.lod_hysteresis = 0.5f;
    CHECK_THROWS_AS((void)shared->submit({eyes, {}, bad}), Error);
    for (uint32_t i = 0; i < shared->framesInFlight(); ++i)
        (void)shared->submit({eyes, {}, {}});
    CHECK_THROWS_AS((void)shared->submit({eyes, {}, {}}), Error);
}
