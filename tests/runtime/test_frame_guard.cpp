// SPDX-License-Identifier: Apache-2.0
// The guard of --target-ms and its levels against scenes whose time is a known function of the bias.
#include "runtime/view/frame_guard.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>
#include <vector>

using namespace gsc;

namespace {

// Time of a frame: `load` milliseconds at bias 0, by a factor of `per_level` less per level, beside `fixed`.
struct Scene {
    double load, per_level = 2, fixed = 0;
    uint32_t dead_time = 0; // frames that the guardler hears of a time late
    double noise = 0;       // relative, uniform
    std::deque<double> late = {};
    std::mt19937 random{7};

    double frame(FrameGuard& guard)
    {
        const double ms = (fixed + load * std::pow(per_level, guard.lodBias())) *
                          (1 + noise * (2 * double(random()) / double(std::mt19937::max()) - 1));
        late.push_back(ms);
        if (late.size() > dead_time) {
            guard.add(late.front());
            late.pop_front();
        }
        return ms;
    }
};

// Frames until `count` in a row are within the target, from now; `limit` if that never is.
int framesToRecover(Scene& scene, FrameGuard& guard, double target, int limit = 1000)
{
    int good = 0;
    for (int i = 0; i < limit; ++i) {
        good = scene.frame(guard) <= target * 1.0001 ? good + 1 : 0;
        if (good == 20)
            return i - 19;
    }
    return limit;
}

struct Ripple {
    double low = std::numeric_limits<double>::infinity(), high = -low, worst_ms = 0;
    [[nodiscard]] double width() const { return high - low; }
};

Ripple watch(Scene& scene, FrameGuard& guard, int frames)
{
    Ripple ripple;
    for (int i = 0; i < frames; ++i) {
        ripple.worst_ms = std::max(ripple.worst_ms, scene.frame(guard));
        ripple.low = std::min(ripple.low, guard.lodBias());
        ripple.high = std::max(ripple.high, guard.lodBias());
    }
    return ripple;
}

} // namespace

TEST_CASE("a scene that fits is left alone")
{
    FrameGuard guard({10, 0.5, -8});
    Scene scene{5};
    CHECK(watch(scene, guard, 200).width() == 0);
    CHECK(guard.lodBias() == 0.5);
}

TEST_CASE("a step to three times the time is met within 60 frames, then nothing moves")
{
    for (const double per_level : {1.5, 2.0, 4.0, 8.0})
        for (const uint32_t dead_time : {0u, 1u, 3u}) {
            CAPTURE(per_level);
            CAPTURE(dead_time);
            FrameGuard guard({10, 0, -16});
            Scene scene{9, per_level, 0, dead_time};
            watch(scene, guard, 50);
            CHECK(guard.lodBias() == 0);
            scene.load = 27;
            CHECK(framesToRecover(scene, guard, 10) <= 60);
            watch(scene, guard, 300); // an overshoot is given back slowly
            const Ripple rest = watch(scene, guard, 300);
            CHECK(rest.width() == 0);
            CHECK(rest.worst_ms <= 10);
            // and no more detail is given up than that takes
            const double needed = std::log(0.9 * 10 / 27) / std::log(per_level);
            CHECK(rest.low >= needed - 0.01);
        }
}

TEST_CASE("overshoot stays within a tenth of the target's detail for a usual scene")
{
    FrameGuard guard({10, 0, -16});
    Scene scene{30, 2, 0, 1};
    const Ripple down = watch(scene, guard, 400);
    CHECK(down.low >= std::log(0.9 * 10 / 30) / std::log(2) - 0.1);
}

TEST_CASE("detail comes back slowly, all of it, within 400 frames, and never past the start")
{
    FrameGuard guard({10, 0.25, -16});
    Scene scene{40, 2, 0, 1};
    watch(scene, guard, 300);
    const double coarse = guard.lodBias();
    CHECK(coarse < -1.5);
    scene.load = 2;
    double before = coarse;
    for (int i = 0; i < 400; ++i) {
        scene.frame(guard);
        CHECK(guard.lodBias() - before <= FrameGuard::kMostUp + 1e-12);
        CHECK(guard.lodBias() >= before);
        before = guard.lodBias();
    }
    CHECK(guard.lodBias() == 0.25);
}

TEST_CASE("noise of 10 % either way moves the bias by less than 0.15 levels")
{
    for (const double per_level : {1.5, 2.0, 4.0}) {
        CAPTURE(per_level);
        FrameGuard guard({10, 0, -16});
        Scene scene{25, per_level, 0, 1, 0.1};
        watch(scene, guard, 300);
        CHECK(watch(scene, guard, 2000).width() < 0.15);
    }
}

TEST_CASE("one late frame, and times that are none, move nothing")
{
    FrameGuard guard({10, 0, -16});
    Scene scene{9.5};
    watch(scene, guard, 20);
    guard.add(500);
    watch(scene, guard, 20);
    CHECK(guard.lodBias() == 0);
    scene.load = 30;
    watch(scene, guard, 20);
    const double bias = guard.lodBias();
    CHECK(bias < 0);
    for (const double wrong : {0.0, -1.0, double(NAN), double(INFINITY)})
        for (int i = 0; i < 5; ++i)
            guard.add(wrong);
    CHECK(guard.lodBias() == bias);
}

TEST_CASE("a target that cannot be met ends at the coarsest and comes back from there")
{
    FrameGuard guard({10, 0, -3});
    Scene scene{20, 2, 12};
    watch(scene, guard, 1000);
    CHECK(guard.lodBias() == -3);
    scene.fixed = 0;
    scene.load = 5;
    watch(scene, guard, 300);
    CHECK(guard.lodBias() == 0);
}

TEST_CASE("a load that goes up and down for ever is followed without swinging")
{
    FrameGuard guard({10, 0, -16});
    Scene scene{15, 2, 2, 1};
    int turns = 0;
    double before = guard.lodBias(), direction = 0;
    for (int i = 0; i < 3000; ++i) {
        scene.load = 20 + 8 * std::sin(double(i) / 200);
        scene.frame(guard);
        const double step = guard.lodBias() - before;
        if (step != 0) {
            turns += direction * step < 0;
            direction = step;
        }
        before = guard.lodBias();
    }
    CHECK(turns <= 8); // the load turns five times
}
