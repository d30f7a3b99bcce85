// SPDX-License-Identifier: Apache-2.0
// Workers that throw, hang, lose their device or run out of memory: the rest goes on, and no pose is lost.
#include "runtime/service/faulty_renderer.h"
#include "tests/service/service_tools.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

using namespace gsc;
using namespace gsc::test;

namespace {

using namespace std::chrono_literals;

#ifdef __SANITIZE_THREAD__
constexpr int kSlower = 5; // than without: what is no fault must not look like one
#else
constexpr int kSlower = 1;
#endif

ServiceOptions faulty(size_t workers, ServiceMode mode, const Faults& faults)
{
    ServiceOptions options = cpuWorkers(workers, mode);
    options.make = withFaults(faults);
    options.deadline = 100ms * kSlower;
    options.comes_back = 2ms;
    options.most_faults = 1000;
    options.attempts = 1000;
    return options;
}

// Bytes that this process has in memory; 0 = unknown.
double residentBytes()
{
    std::ifstream file("/proc/self/statm");
    double pages = 0, resident = 0;
    file >> pages >> resident;
    return resident * 4096;
}

double soakSeconds()
{
    const char* const text = std::getenv("GSC_SOAK_SECONDS");
    return text == nullptr ? 3 : std::atof(text);
}

} // namespace

TEST_CASE("each kind of fault costs no pose and no byte of a picture, in every mode")
{
    const SyntheticModel model(modelOptions());
    const auto one = open(model.view());
    const FrameOptions options = with(ReusePolicy::None);
    constexpr int kPoses = 12;
    std::vector<std::vector<unsigned char>> expected;
    for (int i = 0; i < kPoses; ++i)
        expected.push_back(expectedBytes(*one, i, 2, options));
    Faults throws, hangs, lost, memory;
    throws.throws = lost.lost = memory.memory = 0.2;
    hangs.hangs = 0.2;
    hangs.hang = 150ms * kSlower;
    for (const Faults& faults : {throws, hangs, lost, memory})
        for (const ServiceMode mode : {ServiceMode::Frame, ServiceMode::Eye, ServiceMode::Split}) {
            CAPTURE(serviceModeName(mode));
            RendererService service(model.view(), faulty(3, mode, faults));
            for (int i = 0; i < kPoses; ++i)
                submitWalk(service, i, 2, options);
            for (int i = 0; i < kPoses; ++i) {
                const auto delivery = service.next();
                REQUIRE(delivery);
                CHECK(delivery->pose == uint64_t(i + 1));
                REQUIRE(delivery->end == PoseEnd::Shown);
                CHECK(bytesOf(*delivery, i, 2) == expected[size_t(i)]);
            }
            uint32_t seen = 0;
            for (const WorkerStats& worker : service.stats().workers)
                seen += worker.faults;
            CHECK(seen > 0);
        }
}

TEST_CASE("without a worker left poses fail with its error, and the program goes on")
{
    const SyntheticModel model(modelOptions());
    Faults faults;
    faults.lost = 1;
    ServiceOptions options = faulty(2, ServiceMode::Frame, faults);
    options.most_faults = 2;
    RendererService service(model.view(), options);
    for (int i = 0; i < 3; ++i)
        submitWalk(service, i, 1, FrameOptions{});
    for (int i = 0; i < 3; ++i) {
        const auto delivery = service.next();
        REQUIRE(delivery);
        CHECK(delivery->end == PoseEnd::Failed);
        CHECK_THROWS_AS(std::rethrow_exception(delivery->error), Error);
    }
    submitWalk(service, 3, 1, FrameOptions{}); // when all are gone
    CHECK(service.next()->end == PoseEnd::Failed);
    CHECK(service.stats().workers[0].state == WorkerState::Gone);
    CHECK(service.stats().workers[0].last_fault.find("injected") != std::string::npos);
}

TEST_CASE("a worker that fails each time never pauses longer than 64 times its first pause")
{
    const SyntheticModel model(modelOptions());
    Faults faults;
    faults.throws = 1;
    ServiceOptions options = faulty(1, ServiceMode::Frame, faults);
    options.comes_back = 1ms;
    options.most_faults = 16; // pauses of 0.64 s together, and of 33 s where each is twice the one before
    RendererService service(model.view(), options);
    const auto start = std::chrono::steady_clock::now();
    submitWalk(service, 0, 1, FrameOptions{});
    const auto delivery = service.next();
    REQUIRE(delivery);
    CHECK(delivery->end == PoseEnd::Failed);
    CHECK(service.stats().workers[0].faults == 16);
    CHECK(std::chrono::steady_clock::now() - start < 16s);
}

namespace {

// Answers a call with `act`, which may throw or take its time; draws nothing.
class ActingRenderer final : public Renderer {
public:
    enum class Call { Load, Submit, Wait };
    using Act = std::function<void(Call)>;
    explicit ActingRenderer(Act act) : m_act(std::move(act)) {}

    [[nodiscard]] DeviceId id() const override { return {"cpu"}; }
    [[nodiscard]] DeviceFacts device() const override { return {}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; }
    using Renderer::load;
    void load(const ModelView&) override { m_act(Call::Load); }
    void dropCaches() override {}
    uint64_t submit(const FrameRequest&) override
    {
        m_act(Call::Submit);
        return ++m_ticket;
    }
    FrameState wait(uint64_t, FrameResult& result, std::chrono::nanoseconds) override
    {
        m_act(Call::Wait);
        result = {};
        result.eyes[0].gaussians_visible = 1;
        return FrameState::Done;
    }

private:
    Act m_act;
    uint64_t m_ticket = 0;
};

} // namespace

TEST_CASE("what no worker can draw fails for a caller that waits for it already, and the workers stay")
{
    const SyntheticModel model(modelOptions());
    using Call = ActingRenderer::Call;
    for (const Call fails : {Call::Submit, Call::Wait}) {
        ServiceOptions options = cpuWorkers(1, ServiceMode::Frame);
        std::atomic<bool> is_bad = true;
        options.make = [&](const DeviceId&, const RendererOptions&) {
            return std::make_unique<ActingRenderer>([&, fails](Call call) {
                if (call != fails || !is_bad)
                    return;
                std::this_thread::sleep_for(50ms); // the caller waits by now
                throw Error(ErrorCode::Unsupported, "frame", "not by this backend", "another", "take that");
            });
        };
        RendererService service(model.view(), options);
        submitWalk(service, 0, 1, FrameOptions{});
        const auto failed = service.next(20s);
        REQUIRE(failed);
        CHECK(failed->end == PoseEnd::Failed);
        CHECK_THROWS_AS(std::rethrow_exception(failed->error), Error);
        is_bad = false;
        submitWalk(service, 1, 1, FrameOptions{});
        CHECK(service.next(20s)->end == PoseEnd::Shown);
        CHECK(service.stats().workers[0].faults == 0);
    }
}

TEST_CASE("a worker that hangs while it loads is left alone, at the start and after a fault")
{
    const SyntheticModel model(modelOptions());
    using Call = ActingRenderer::Call;
    struct State {
        std::atomic<int> loads = 0, hangs_at = 1;
        std::atomic<bool> throws = false, ends = false;
    };
    const auto state = std::make_shared<State>(); // a thread that hangs goes on when this has ended
    ServiceOptions options = cpuWorkers(1, ServiceMode::Frame);
    options.load_deadline = 50ms;
    options.comes_back = 2ms;
    options.make = [state](const DeviceId&, const RendererOptions&) {
        return std::make_unique<ActingRenderer>([state](Call call) {
            if (call == Call::Load && ++state->loads == state->hangs_at)
                while (!state->ends)
                    std::this_thread::sleep_for(1ms);
            if (call == Call::Submit && state->throws.exchange(false))
                throw std::runtime_error("once");
        });
    };
    CHECK_THROWS_AS(RendererService(model.view(), options), Error);
    state->ends = true;
    std::this_thread::sleep_for(20ms);
    state->ends = false;
    state->loads = 0;
    state->hangs_at = 2; // after the fault
    state->throws = true;
    RendererService service(model.view(), options);
    submitWalk(service, 0, 1, FrameOptions{});
    const auto delivery = service.next(20s);
    REQUIRE(delivery);
    CHECK(delivery->end == PoseEnd::Shown);
    CHECK(service.stats().workers[0].faults == 2);
    CHECK(service.stats().workers[0].last_fault.find("loading") != std::string::npos);
    CHECK(state->loads == 3);
    state->ends = true;
}

TEST_CASE("where the first worker cannot be made another draws, also one that rested")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = cpuWorkers(2, ServiceMode::Frame);
    options.pace.min_fps = 1;
    std::atomic<int> made = 0;
    options.make = [&](const DeviceId& device, const RendererOptions& limits) {
        if (made++ == 0)
            throw Error(ErrorCode::OutOfMemory, "device", "no memory", "some", "take less");
        return makeRenderer(device, limits);
    };
    RendererService service(model.view(), options);
    submitWalk(service, 0, 1, FrameOptions{});
    CHECK(service.next(20s)->end == PoseEnd::Shown);
    options.make = {};
    options.devices[1] = {"cpu", 7}; // rests, and is a mistake all the same
    CHECK_THROWS_AS(RendererService(model.view(), options), Error);
}

TEST_CASE("a service whose workers cannot be made says why, and one that is there is enough")
{
    const SyntheticModel model(modelOptions());
    ServiceOptions options = cpuWorkers(2, ServiceMode::Frame);
    options.devices[0].backend = "no-such";
    CHECK_THROWS_AS(RendererService(model.view(), options), Error); // a mistake of the caller's
    options.devices[0].backend = "cpu";
    bool first = true; // one that fails may come back, so one that is there is enough
    std::mutex mutex;
    options.make = [&](const DeviceId& device, const RendererOptions& limits) {
        const std::lock_guard lock(mutex);
        if (std::exchange(first, false))
            throw Error(ErrorCode::OutOfMemory, "device", "no memory", "some", "take less");
        return makeRenderer(device, limits);
    };
    CHECK_NOTHROW(RendererService(model.view(), options));
    options.make = [](const DeviceId&, const RendererOptions&) -> std::unique_ptr<Renderer> {
        throw Error(ErrorCode::OutOfMemory, "device", "no memory", "some", "take less");
    };
    CHECK_THROWS_AS(RendererService(model.view(), options), Error);
    options.make = {};
    options.devices.clear();
    CHECK_THROWS_AS(RendererService(model.view(), options), Error);
    options = cpuWorkers(1, ServiceMode::Frame);
    options.pace.min_fps = 100;
    options.pace.max_fps = 50;
    CHECK_THROWS_AS(RendererService(model.view(), options), Error);
}

// GSC_SOAK_SECONDS says how long; CI's is a minute, see tests.cmake.
TEST_CASE("random faults for a while: no pose lost, none out of order or twice, memory flat")
{
    const SyntheticModel model(modelOptions());
    double before = 0, grown = 0;
    uint64_t poses = 0, faults_seen = 0;
    for (const bool keeps_all : {true, false}) {
        Faults faults;
        faults.throws = faults.lost = faults.memory = 0.01;
        faults.hangs = 0.003;
        faults.hang = 120ms * kSlower;
        faults.seed = keeps_all ? 5 : 6;
        ServiceOptions options = faulty(3, ServiceMode::Frame, faults);
        options.keeps_all = keeps_all;
        options.timeout = keeps_all ? 0ms : 50ms;
        options.deadline = 60ms * kSlower;
        options.trace_limit = 100;
        options.mode = keeps_all ? ServiceMode::Split : ServiceMode::Auto;
        RendererService service(model.view(), options);
        const auto start = std::chrono::steady_clock::now();
        const auto seconds = [&] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        };
        uint64_t shown = 0, delivered = 0, last = 0;
        before = 0;
        const double length = soakSeconds() / 2;
        for (int i = 0; seconds() < length; ++i) {
            last = submitWalk(service, i % 40, i % 2 + 1, FrameOptions{});
            while (keeps_all ? last - shown >= 8 : true) {
                const auto delivery = service.next(keeps_all ? 10s : 1ms);
                if (!delivery)
                    break;
                REQUIRE(delivery->pose > shown);
                if (keeps_all)
                    REQUIRE(delivery->pose == shown + 1);
                REQUIRE(delivery->end == PoseEnd::Shown);
                shown = delivery->pose;
                ++delivered;
            }
            if (before == 0 && seconds() > length / 4)
                before = residentBytes();
        }
        grown = residentBytes() - before;
        while (const auto delivery = service.next()) {
            REQUIRE(delivery->pose > shown);
            shown = delivery->pose;
            ++delivered;
        }
        const LedgerCounts counts = service.stats().counts;
        CHECK(counts.submitted == last);
        CHECK(counts.open() == 0);
        CHECK(counts.of(PoseEnd::Shown) == delivered);
        CHECK(counts.of(PoseEnd::Failed) == 0);
        if (keeps_all)
            CHECK(delivered == last);
        poses += last;
        for (const WorkerStats& worker : service.stats().workers)
            faults_seen += worker.faults;
        std::printf("%s: %llu poses, %llu shown, resident memory %+.1f MB in the last three quarters\n",
                    keeps_all ? "all kept" : "newest", static_cast<unsigned long long>(last),
                    static_cast<unsigned long long>(delivered), grown / 1e6);
        if (soakSeconds() >= 30)
            CHECK(grown < 16e6);
    }
    CHECK(faults_seen > 0);
    std::printf("%llu poses, %llu faults\n", static_cast<unsigned long long>(poses),
                static_cast<unsigned long long>(faults_seen));
}
