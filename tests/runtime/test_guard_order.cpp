// SPDX-License-Identifier: Apache-2.0
// Order in which the guard of --target-ms gives things up.
#include "runtime/view/frame_guard.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace gsc;

namespace {

// Frames of ten times the target until nothing more can be given up.
struct Fall {
    double levels_before_fovea = 0, fovea_before_last_levels = 0; // parts given up when the next one began
    double lod_bias = 0, fovea_pixels = 0;                        // in the end
};

Fall fall(FrameGuard guard, double finest, double pixels)
{
    Fall seen;
    for (int i = 0; i < 500; ++i) {
        const double bias = guard.lodBias(), fovea = guard.foveaPixels();
        guard.add(100);
        CHECK(guard.lodBias() <= bias);
        CHECK(guard.foveaPixels() >= fovea);
        if (fovea == pixels)
            seen.levels_before_fovea = finest - bias;
        if (finest - bias <= FrameGuard::kLevelsFirst)
            seen.fovea_before_last_levels = fovea;
    }
    seen.lod_bias = guard.lodBias();
    seen.fovea_pixels = guard.foveaPixels();
    return seen;
}

} // namespace

TEST_CASE("levels fall first, then what the periphery shows, then the levels that are left")
{
    const Fall seen = fall(FrameGuard({10, 1, -6, 2}), 1, 2);
    CHECK(seen.levels_before_fovea == doctest::Approx(2).epsilon(0.1));
    CHECK(seen.fovea_before_last_levels == doctest::Approx(8).epsilon(0.15)); // a step is up to 0.2 doublings
    CHECK(seen.lod_bias == doctest::Approx(-6));
    CHECK(seen.fovea_pixels == doctest::Approx(8));
}

TEST_CASE("a model with one level gives up the periphery alone; without foveation levels fall alone")
{
    const Fall one_level = fall(FrameGuard({10, 0, 0, 1.5}), 0, 1.5);
    CHECK(one_level.lod_bias == 0);
    CHECK(one_level.fovea_pixels == doctest::Approx(6));
    CHECK(fall(FrameGuard({10, 0, 0, 30}), 0, 30).fovea_pixels ==
          doctest::Approx(100)); // largest value that a frame takes
    CHECK(fall(FrameGuard({10, 0, 0, 100}), 0, 100).fovea_pixels == 100);
    const Fall levels = fall(FrameGuard({10, 0, -8, 0}), 0, 0);
    CHECK(levels.lod_bias == doctest::Approx(-8));
    CHECK(levels.fovea_pixels == 0);
}

TEST_CASE("all is given back when frames are quick again")
{
    FrameGuard guard({10, 0.5, -4, 2});
    for (int i = 0; i < 200; ++i)
        guard.add(50);
    CHECK(guard.lodBias() < -3);
    for (int i = 0; i < 2000; ++i)
        guard.add(1);
    CHECK(guard.lodBias() == 0.5);
    CHECK(guard.foveaPixels() == 2);
}

TEST_CASE("detail becomes coarser first and is given back last")
{
    FrameGuard guard({10, 0.5, -4, 2, 1, 4});
    double detail = guard.detail();
    std::vector<double> steps = {detail};
    for (int i = 0; i < 1000; ++i) {
        guard.add(i < 20 ? 11 : 50);
        if (guard.detail() != detail)
            steps.push_back(detail = guard.detail());
        if (detail < 4) { // levels bridge a few frames, the periphery none
            CHECK(guard.lodBias() >= 0.5 - 2 * FrameGuard::kRemade * FrameGuard::kBridge * std::log(11 / 9.5));
            CHECK(guard.foveaPixels() == 2);
        }
    }
    CHECK(steps == std::vector<double>{1, 2, 4});
    CHECK(guard.lodBias() == doctest::Approx(-4));
    CHECK(guard.foveaPixels() == doctest::Approx(8));
    for (int i = 0; i < 2000; ++i) {
        const bool all = guard.lodBias() == 0.5 && guard.foveaPixels() == 2;
        guard.add(1);
        CHECK((all || guard.detail() == 4));
    }
    CHECK(guard.detail() == 1);
    FrameOptions frame;
    guard.applyTo(frame);
    CHECK(frame.detail == 1.0f);
    CHECK(frame.lod_bias == 0.5f);
    CHECK(frame.foveation.smallest == 2.0f);
}

TEST_CASE("from everything by itself detail goes to one pixel, and back only where that may fit")
{
    FrameGuard guard({10, 0, 0, 0, 0, 4});
    for (int i = 0; i < 3; ++i)
        guard.add(20);
    CHECK(guard.detail() == FrameGuard::kFirstDetail);
    for (int i = 0; i < 1000; ++i)
        guard.add(5);
    CHECK(guard.detail() == FrameGuard::kFirstDetail);
    for (int i = 0; i < 3; ++i)
        guard.add(3.9);
    CHECK(guard.detail() == 0);
}

TEST_CASE("a start with detail is given time to make copies")
{
    FrameGuard guard({10, 0, 0, 0, 2, 4});
    for (uint32_t i = 0; i + 1 < FrameGuard::kRemade; ++i) {
        guard.add(20);
        CHECK(guard.detail() == 2);
    }
}

TEST_CASE("what cannot be drawn coarse, or coarser, is left as it is")
{
    for (const double detail : {0.0, 6.0}) {
        FrameGuard guard({10, 0, -4, 0, detail, detail});
        for (int i = 0; i < 500; ++i) {
            guard.add(i < 250 ? 50 : 1);
            CHECK(guard.detail() == detail);
        }
    }
}
