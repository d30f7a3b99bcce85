// SPDX-License-Identifier: Apache-2.0
// The guard of --target-ms with detail, against a made-up scene of coarse copies that are made anew some a frame.
#include "kernels/coarse/coarse_rule.h"
#include "runtime/view/frame_guard.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

using namespace gsc;

namespace {

constexpr double kTarget = 10;

// Milliseconds of a frame: `load` where everything is drawn by itself. A group costs a share of that as its copy is fine, a
// third more where that is made, and all of it where it has no copy that fits. Copies age by the rule of the backends.
struct CoarseScene {
    double load = 9;
    double per_level = 2;   // by so much less per level; 1 = there is one
    uint32_t dead_time = 1; // frames that the guard hears of a time late
    size_t budget = 200;    // groups that a frame makes

    struct Group {
        double detail = 0, bias = 0; // values that its copy was made for; 0 = it has none
        double change = 0;           // change in this frame
    };
    std::vector<Group> groups = std::vector<Group>(1000);
    std::deque<double> late = {};

    static double shareOf(double detail) { return 0.62 * std::pow(0.8, std::log2(detail)); }

    static double changeOf(const Group& group, double detail, double bias)
    {
        if (group.detail == 0)
            return 1000;
        CoarseView view{};
        view.lod_bias = float(bias);
        view.most_closer = kMostCloser;
        view.most_further = kMostFurther;
        const float low[3] = {9, -1, -1}, high[3] = {11, 1, 1};
        const CoarseKey key{{}, {float(group.detail), float(group.detail)}, float(group.bias)};
        return double(coarseChange(view, key, {float(detail), float(detail)}, low, high));
    }

    double frame(FrameGuard& guard)
    {
        const double detail = guard.detail(), bias = guard.lodBias();
        double sum = detail > 0 ? 0 : double(groups.size());
        if (detail > 0) {
            for (Group& group : groups)
                group.change = changeOf(group, detail, bias);
            std::ranges::stable_sort(groups, std::ranges::greater(), &Group::change);
            for (size_t i = 0; i < groups.size(); ++i) {
                const double change = groups[i].change;
                if (change > 1 && i < budget) {
                    groups[i] = {detail, bias, 0};
                    sum += shareOf(detail) + 1.0 / 3;
                } else {
                    sum += change > double(kStaleMost) ? 1 : shareOf(groups[i].detail);
                }
            }
        }
        const double ms = load * sum / double(groups.size()) * std::pow(per_level, bias);
        late.push_back(ms);
        if (late.size() > dead_time) {
            guard.add(late.front());
            late.pop_front();
        }
        return ms;
    }
};

FrameGuard guardOf(double detail, bool levels = true)
{
    return FrameGuard({kTarget, 0, levels ? -8.0 : 0.0, 0, detail, 4});
}

// Frames until `count` in a row are within the target, from now; `limit` if that never is.
int framesToRecover(CoarseScene& scene, FrameGuard& guard, int limit = 400)
{
    int good = 0;
    for (int i = 0; i < limit; ++i) {
        good = scene.frame(guard) <= kTarget ? good + 1 : 0;
        if (good == 30)
            return i - 29;
    }
    return limit;
}

// A scene whose frames take 0.95 of the target at rest, in the detail that the guard starts with.
CoarseScene restingScene(FrameGuard& guard, double detail)
{
    CoarseScene scene;
    const double share = detail > 0 ? CoarseScene::shareOf(detail) : 1;
    scene.load = 0.5 * kTarget;
    for (int i = 0; i < 60; ++i)
        (void)scene.frame(guard);
    scene.load = 0.95 * kTarget / share;
    for (int i = 0; i < 60; ++i)
        (void)scene.frame(guard);
    CHECK(guard.detail() == detail);
    CHECK(guard.lodBias() == 0);
    return scene;
}

} // namespace

TEST_CASE("after a step of 1.5 in cost frames are within the target in 12 frames")
{
    for (const double detail : {0.0, 1.0, 2.0})
        for (const uint32_t dead_time : {0u, 1u, 2u}) {
            CAPTURE(detail);
            CAPTURE(dead_time);
            FrameGuard guard = guardOf(detail);
            CoarseScene scene = restingScene(guard, detail);
            scene.dead_time = dead_time;
            scene.load *= 1.5;
            CHECK(framesToRecover(scene, guard) <= 12);
            CHECK(guard.detail() > detail);
        }
    for (const double detail : {0.0, 1.0}) { // a model of one level
        CAPTURE(detail);
        FrameGuard guard = guardOf(detail, false);
        CoarseScene scene = restingScene(guard, detail);
        scene.load *= 1.5;
        CHECK(framesToRecover(scene, guard) <= 12);
        CHECK(guard.lodBias() == 0);
    }
}

TEST_CASE("what the guard does makes no frame much longer than the step did, and then nothing moves")
{
    for (const double detail : {0.0, 0.5, 1.0, 2.0, 4.0})
        for (const double step : {1.2, 1.5, 2.0, 3.0}) {
            CAPTURE(detail);
            CAPTURE(step);
            FrameGuard guard = guardOf(detail);
            CoarseScene scene = restingScene(guard, detail);
            scene.load *= step;
            const double at_first = scene.frame(guard);
            for (int i = 0; i < 1500; ++i) {
                CHECK(scene.frame(guard) <= 1.3 * at_first); // some are made beside those that are drawn
            }
            const double rests = guard.detail(), bias = guard.lodBias();
            for (int i = 0; i < 500; ++i) {
                CHECK(scene.frame(guard) <= kTarget);
                CHECK(guard.detail() == rests);
                CHECK(guard.lodBias() == bias);
            }
        }
}

TEST_CASE("all is given back, and no frame is over the target meanwhile")
{
    for (const double detail : {0.0, 1.0, 3.0}) {
        CAPTURE(detail);
        FrameGuard guard = guardOf(detail);
        CoarseScene scene = restingScene(guard, detail);
        scene.load *= 4;
        for (int i = 0; i < 300; ++i)
            (void)scene.frame(guard);
        CHECK(guard.detail() == 4);
        CHECK(guard.lodBias() < -0.5);
        scene.load = 0.5 * kTarget;
        for (int i = 0; i < 800; ++i)
            CHECK(scene.frame(guard) <= kTarget);
        CHECK(guard.detail() == detail);
        CHECK(guard.lodBias() == 0);
    }
}

TEST_CASE("what everything by itself would not fit in stays coarse: detail is not switched to and fro")
{
    FrameGuard guard = guardOf(0);
    CoarseScene scene = restingScene(guard, 0);
    scene.load = 1.15 * kTarget; // 7.1 ms with the finest detail
    for (int i = 0; i < 100; ++i)
        (void)scene.frame(guard);
    for (int i = 0; i < 2000; ++i) {
        CHECK(scene.frame(guard) <= kTarget);
        CHECK(guard.detail() >= 1);
    }
    CHECK(guard.detail() == 1);
    CHECK(guard.lodBias() == 0);
}
