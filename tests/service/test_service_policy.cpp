// SPDX-License-Identifier: Apache-2.0
// When workers start and stop, what frames will cost, where bands are cut and which plan is chosen: with a simulated clock.
#include "runtime/service/policy/bands.h"
#include "runtime/service/policy/frame_cost.h"
#include "runtime/service/policy/mode_choice.h"
#include "runtime/service/policy/pace.h"
#include "runtime/service/service_trace.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

using namespace gsc;

namespace {

using namespace std::chrono_literals;

// Workers of which each draws a frame in so many milliseconds; looked at every 5 ms.
struct Simulation {
    explicit Simulation(const PaceRules& rules, uint32_t all) : pace(rules), most(all) {}

    void run(ServiceTime length, double ms)
    {
        for (const ServiceTime end = now + length; now < end; now += 5ms) {
            const double rate = working * 1000 / ms;
            const PaceDecision step = pace.look(now, {working, 0, most - working, rate, 0});
            starts += step.step == PaceStep::Start;
            stops += step.step == PaceStep::Stop;
            if (step.step != PaceStep::Keep) {
                CHECK_FALSE(step.cause.empty());
                last = now;
            }
            working += step.step == PaceStep::Start;
            working -= step.step == PaceStep::Stop;
        }
    }

    Pace pace;
    uint32_t most, working = 1, starts = 0, stops = 0;
    ServiceTime now{0}, last{0};
};

PaceRules between(double min_fps, double max_fps)
{
    PaceRules rules;
    rules.min_fps = min_fps;
    rules.max_fps = max_fps;
    return rules;
}

// Feeds a choice with frames of workers that take so long, in the mean, until it has decided. Frames of a flight: one
// takes up to four times what another does, and its neighbours nearly as much.
void feed(ModeChoice& choice, ServiceTime& now, double frame_ms, double eye_ms, double split_ms, bool one_at_a_time)
{
    std::mt19937 random(11);
    const auto draw = [&](double low, double high) { return low + (high - low) * double(random() % 10000) / 10000; };
    for (int i = 0; i < 500 && !choice.decided(); ++i) {
        const SharePlan plan = choice.plan();
        const double mean = plan.mode == ServiceMode::Eye     ? eye_ms
                            : plan.mode == ServiceMode::Split ? split_ms
                                                              : frame_ms;
        const double hard = 0.6 + 0.9 * (1 + std::sin(i * 0.16)), ms = mean * hard * draw(0.98, 1.02);
        const double step = plan.mode == ServiceMode::Frame && !one_at_a_time ? ms / plan.workers : ms;
        now += std::chrono::nanoseconds(int64_t(step * 1e6));
        choice.add(choice.serial(), {now, ms, ms});
    }
    CHECK(choice.decided());
}

SharePlan chosen(double wanted, double frame_ms, double eye_ms, double split_ms, bool one_at_a_time)
{
    ModeChoice choice(wanted);
    choice.begin(ModeChoice::plansFor(2, 2, false, true));
    ServiceTime now{0};
    feed(choice, now, frame_ms, eye_ms, split_ms, one_at_a_time);
    return choice.plan();
}

} // namespace

TEST_CASE("a worker starts soon after the rate has fallen below the least, and no sooner")
{
    Simulation short_dip(between(90, 120), 4);
    short_dip.run(1s, 10);
    short_dip.run(15ms, 12); // one worker draws 83 a second, for three looks
    short_dip.run(1s, 10);
    CHECK(short_dip.starts == 0);

    Simulation slow(between(90, 120), 4);
    slow.run(1s, 10);
    slow.run(1s, 20);
    CHECK(slow.starts == 1);
    CHECK(slow.working == 2);
    CHECK(slow.last - 1s <= 50ms);
    slow.run(1s, 40);
    CHECK(slow.working == 4); // 75 and 100: one at a time
}

TEST_CASE("while a worker loads no other starts, however long it takes")
{
    Pace pace(between(90, 120));
    uint32_t starts = 0;
    ServiceTime now{0};
    for (; now < 5s; now += 5ms) // told to start, loads for five seconds
        starts += pace.look(now, {1 + starts, starts, 3 - starts, 50, 0}).step == PaceStep::Start;
    CHECK(starts == 1);
    const ServiceTime ready = now;
    while (starts == 1 && now < 10s) // draws, and the two are too slow
        starts += pace.look(now += 5ms, {2, 0, 2, 80, 0}).step == PaceStep::Start;
    CHECK(starts == 2);
    CHECK(now - ready >= 90ms);
    CHECK(now - ready <= 150ms);
}

TEST_CASE("a rate that was low, then unknown, is not low all the while")
{
    Pace pace(between(90, 120));
    CHECK(pace.look(1000ms, {1, 0, 1, 50, 0}).step == PaceStep::Keep);
    CHECK(pace.look(2000ms, {1, 0, 1, 0, 0}).step == PaceStep::Keep);
    CHECK(pace.look(2005ms, {1, 0, 1, 50, 0}).step == PaceStep::Keep);
    CHECK(pace.look(2030ms, {1, 0, 1, 50, 0}).step == PaceStep::Start);
}

TEST_CASE("a worker stops only where the rate stays above what keeps another start away")
{
    Simulation loop(between(90, 120), 4);
    loop.run(1s, 40);
    CHECK(loop.working == 4);
    loop.run(3s, 30); // 133 of four: above 120 but below (1 + 1/3) of it
    CHECK(loop.working == 4);
    CHECK(loop.stops == 0);
    loop.run(900ms, 10);
    CHECK(loop.stops == 0); // not for a while
    loop.run(10s, 10);
    CHECK(loop.working == 2); // 200 of two is less than (1 + 1/1) of 120
    loop.run(10s, 8);
    CHECK(loop.working == 1);
    CHECK(loop.starts == 3); // the rate of those that remained was above the least
}

TEST_CASE("what frames cost is learned although the first shows nothing, or next to nothing")
{
    for (const double first : {0.0, 1.0}) {
        FrameCost cost;
        cost.learn(0ms, {first, first, first}, 0.5);
        for (int i = 1; i < 60; ++i) { // 1 ms, and 2 for a million of anchors, pairs and evaluations each
            const double load = 1e6 * (1 + 0.05 * i);
            cost.learn(i * 10ms, {load, load * 3, load * 20}, 1 + load / 1e6 * 2);
        }
        CHECK(cost.costOf({4e6, 12e6, 80e6}) == doctest::Approx(9).epsilon(0.05));
        CHECK(cost.costOf({8e6, 24e6, 160e6}) == doctest::Approx(17).epsilon(0.05));
        CHECK(cost.predict(700ms) > cost.predict(590ms) * 1.05);
    }
}

TEST_CASE("starts and stops do not follow each other for ever, whatever the cost of a frame")
{
    for (double ms = 1; ms < 60; ms *= 1.03) {
        CAPTURE(ms);
        Simulation loop(between(90, 120), 4);
        loop.run(20s, ms);
        const uint32_t steps = loop.starts + loop.stops;
        CHECK(steps <= 3);
        loop.run(20s, ms);
        CHECK(loop.starts + loop.stops == steps);
    }
}

TEST_CASE("a prediction alone counts where no rate is known yet")
{
    Pace pace(between(90, 0));
    CHECK(pace.look(1000ms, {1, 0, 1, 0, 100}).step == PaceStep::Keep);
    CHECK(pace.look(2000ms, {1, 0, 1, 0, 100}).step == PaceStep::Keep);
    CHECK(pace.look(2005ms, {1, 0, 1, 0, 80}).step == PaceStep::Keep);
    CHECK(pace.look(2105ms, {1, 0, 1, 0, 80}).step == PaceStep::Start);
}

TEST_CASE("a predicted fall starts a worker before the rate has fallen")
{
    Pace pace(between(90, 0));
    PaceStep step = PaceStep::Keep;
    for (ServiceTime now{0}; now < 100ms; now += 5ms) {
        const PaceDecision decision = pace.look(now, {1, 0, 1, 100, 80});
        if (decision.step == PaceStep::Start) {
            step = decision.step;
            CHECK(decision.cause.find("predicted") != std::string::npos);
            break;
        }
    }
    CHECK(step == PaceStep::Start);
}

TEST_CASE("the cost of a frame follows its counts, and the counts go on as they have changed")
{
    FrameCost cost;
    CHECK(cost.predict(0ms) == 0);
    std::mt19937 random(3);
    const auto draw = [&] { return 0.5 + double(random() % 1000) / 1000; };
    const auto ms = [](const FrameLoad& load) {
        return 0.5 + load.anchors * 2e-6 + load.pairs * 1e-6 + load.evaluations * 1e-8;
    };
    FrameLoad load;
    ServiceTime now{0};
    for (int i = 0; i < 300; ++i, now += 10ms) {
        load = {1e6 * draw(), 2e6 * draw(), 3e8 * draw()};
        cost.learn(now, load, ms(load));
    }
    for (int i = 0; i < 20; ++i) {
        load = {1e6 * draw(), 2e6 * draw(), 3e8 * draw()};
        CHECK(cost.costOf(load) == doctest::Approx(ms(load)).epsilon(0.02));
    }
    // a camera that flies away: more of everything in each frame
    for (int i = 0; i < 20; ++i, now += 10ms) {
        load = {1e6 * (1 + 0.05 * i), 2e6 * (1 + 0.05 * i), 3e8 * (1 + 0.05 * i)};
        cost.learn(now, load, ms(load));
    }
    const FrameLoad then{1e6 * 2.45, 2e6 * 2.45, 3e8 * 2.45}; // 100 ms after the last frame
    CHECK(cost.predict(now + 90ms) == doctest::Approx(ms(then)).epsilon(0.03));
    CHECK(cost.predict(now + 10s) == doctest::Approx(cost.predict(now + FrameCost::kHorizon - 10ms)).epsilon(1e-6));
}

TEST_CASE("bands cover the image, and come to take equally long")
{
    BandBalance balance;
    for (const uint32_t width : {1u, 31u, 32u, 33u, 1080u, 2048u, 2208u})
        for (const uint32_t count : {1u, 2u, 3u, 4u, 8u}) {
            const std::vector<ColumnRange> bands = balance.cut(width, count);
            CHECK(bands.size() == std::min(count, (width + kColumnStep - 1) / kColumnStep));
            uint32_t at = 0;
            for (const ColumnRange& band : bands) {
                CHECK(band.first == at);
                CHECK(band.end > band.first);
                CHECK(band.first % kColumnStep == 0);
                at = band.end;
            }
            CHECK(at >= width);
            CHECK(bands.back().end % kColumnStep == 0);
        }
    // the sea on the left, a city on the right
    const auto costs = [](uint32_t column) { return column < 1024 ? 0.1 : 1 + double(column - 1024) / 512; };
    const auto msOf = [&](const ColumnRange& band) {
        double ms = 0.05; // cost of every band
        for (uint32_t column = band.first; column < std::min(band.end, 2048u); ++column)
            ms += costs(column) / 1000;
        return ms;
    };
    for (const uint32_t count : {2u, 4u}) {
        BandBalance own;
        std::vector<double> ms;
        for (int frame = 0; frame < 12; ++frame) {
            const std::vector<ColumnRange> bands = own.cut(2048, count);
            ms.clear();
            for (const ColumnRange& band : bands)
                ms.push_back(msOf(band));
            own.learn(2048, bands, ms);
        }
        const double mean = std::accumulate(ms.begin(), ms.end(), 0.0) / count;
        CHECK(*std::ranges::max_element(ms) < 1.12 * mean);
    }
}

TEST_CASE("the plan is the one with the least latency that holds the rate, or with the most frames")
{
    CHECK(chosen(0, 10, 7, 6, false) == SharePlan{ServiceMode::Frame, 2}); // 200 a second against 167
    CHECK(chosen(0, 10, 7, 4, false) == SharePlan{ServiceMode::Split, 2});
    CHECK(chosen(0, 10, 7, 6, true) == SharePlan{ServiceMode::Split, 2}); // who asks for one at a time gets no turns
    CHECK(chosen(90, 10, 7, 6, false) == SharePlan{ServiceMode::Split, 2});
    CHECK(chosen(90, 10, 6, 7, false) == SharePlan{ServiceMode::Eye, 2});
    CHECK(chosen(90, 10, 6.4, 6, false) ==
          SharePlan{ServiceMode::Split, 2}); // 6 % of difference among frames of a flight
    CHECK(chosen(90, 10, 6, 6.4, false) == SharePlan{ServiceMode::Eye, 2});
    CHECK(chosen(150, 10, 7, 8, false) == SharePlan{ServiceMode::Frame, 2}); // nothing else holds it
    CHECK(chosen(300, 10, 7, 6, false) == SharePlan{ServiceMode::Frame, 2}); // nothing holds it: the fastest
}

TEST_CASE("one worker draws where several are no faster, and that is said")
{
    ModeChoice choice(0);
    choice.begin(ModeChoice::plansFor(2, 2, false, true));
    ServiceTime now{0};
    feed(choice, now, 0.20, 0.18, 0.17, true);
    CHECK(choice.plan() == SharePlan{ServiceMode::Frame, 1});
    CHECK(choice.cause().find("one worker is as fast") != std::string::npos);
    CHECK_FALSE(choice.drifted());
    for (int i = 0; i < 100; ++i) // frames come to take another time
        choice.add(choice.serial(), {now += 1ms, 1, 1});
    CHECK(choice.drifted());
}

TEST_CASE("plans: one eye is not shared by eyes, and merged eyes stay together")
{
    const auto has = [](const std::vector<SharePlan>& plans, ServiceMode mode) {
        return std::ranges::any_of(plans, [&](const SharePlan& plan) { return plan.mode == mode; });
    };
    CHECK(ModeChoice::plansFor(1, 2, false, false) == std::vector<SharePlan>{{ServiceMode::Frame, 1}});
    CHECK(has(ModeChoice::plansFor(4, 2, false, true), ServiceMode::Eye));
    CHECK_FALSE(has(ModeChoice::plansFor(4, 1, false, true), ServiceMode::Eye));
    CHECK_FALSE(has(ModeChoice::plansFor(4, 2, true, true), ServiceMode::Eye));
    CHECK(ModeChoice::plansFor(4, 2, false, true).front().workers == 1);
    CHECK(ModeChoice::plansFor(4, 2, false, false).front().workers == 4);
}

TEST_CASE("percentiles of latency are within the width of a bucket")
{
    LatencyCounts counts;
    CHECK(counts.stats().p99 == 0);
    for (int i = 1; i <= 1000; ++i)
        counts.add(i * 0.01);
    const LatencyStats stats = counts.stats();
    CHECK(stats.p50 == doctest::Approx(5).epsilon(0.02));
    CHECK(stats.p95 == doctest::Approx(9.5).epsilon(0.02));
    CHECK(stats.p99 == doctest::Approx(9.9).epsilon(0.02));
    CHECK(stats.most == 10);
}
