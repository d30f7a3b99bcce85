// SPDX-License-Identifier: Apache-2.0
// What the guard of a headset's frames gives up, and in which order.
#include "player/xr/frame_guard.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;

namespace {

// Frames of ten times the target until nothing more can be given up.
struct Fall {
    double levels_before_fovea = 0, fovea_before_last_levels = 0; // what had been given up when the next began
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
          doctest::Approx(100)); // what a frame may be asked for
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
