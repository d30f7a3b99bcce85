// SPDX-License-Identifier: Apache-2.0
#include "player/window/rest_pictures.h"
#include "runtime/view/frame_guard.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

using namespace gsc;

namespace {

constexpr int kNever = 1000;

CoarseCounts counts(uint64_t near, uint64_t kept, uint64_t stale, uint64_t made)
{
    CoarseCounts counts;
    counts.near = near;
    counts.kept = kept;
    counts.stale = stale;
    counts.made = made;
    return counts;
}

// Pictures of a view until it rests; `of` has the counts of each, from 0.
int picturesUntilRest(const std::function<CoarseCounts(int)>& of)
{
    RestPictures rest;
    for (int i = 0; i < kNever; ++i)
        if (!rest.goOn(of(i), false))
            return i + 1;
    return kNever;
}

// Milliseconds of a frame that is drawn with what the guard says.
double frameMs(double load, const FrameGuard& guard)
{
    const double coarse = guard.detail() > 0 ? 0.6 * std::pow(0.8, std::log2(guard.detail())) : 1;
    return load * coarse * std::pow(1.5, guard.lodBias());
}

// Pictures of a view at rest as a window draws them: again where the guard changed something, or for RestPictures.
int picturesUntilRest(FrameGuard& guard, double load)
{
    RestPictures rest;
    for (int i = 0; i < kNever; ++i) {
        const double detail = guard.detail(), bias = guard.lodBias();
        guard.add(frameMs(load, guard));
        const bool again = rest.goOn({}, guard.gaveUp());
        const bool changed = detail != guard.detail() || bias != guard.lodBias();
        if (changed)
            rest.changed();
        else if (!again)
            return i + 1;
    }
    return kNever;
}

} // namespace

TEST_CASE("a view without detail rests at once")
{
    CHECK(picturesUntilRest([](int) { return CoarseCounts{}; }) == 1);
}

TEST_CASE("a view with detail is drawn until no copy is stale and none is to be made")
{
    CHECK(picturesUntilRest([](int) { return counts(40, 60, 0, 0); }) == 2); // near for good keeps nothing awake
    CHECK(picturesUntilRest([](int) { return counts(100, 0, 0, 0); }) == 2);
    const auto some_a_frame = [](int i) {
        return counts(100, uint64_t(100 * i), uint64_t(i < 5 ? 500 - 100 * i : 0), i < 5 ? 100 : 0);
    };
    CHECK(picturesUntilRest(some_a_frame) == 7);
    // another appearance: a frame forgets all copies and makes none
    CHECK(picturesUntilRest([&](int i) { return i == 0 ? counts(600, 0, 0, 0) : some_a_frame(i - 1); }) == 8);
    CHECK(picturesUntilRest([](int i) { return i < 9 ? counts(0, 90, 10, 0) : counts(0, 100, 0, 0); }) == 11);
}

TEST_CASE("copies that are stale or made anew for good do not keep a view awake")
{
    CHECK(picturesUntilRest([](int) { return counts(0, 90, 10, 0); }) == int(RestPictures::kMost));
    CHECK(picturesUntilRest([](int) { return counts(0, 90, 0, 10); }) == int(RestPictures::kMost));
    RestPictures rest;
    for (uint32_t i = 0; i < 2 * RestPictures::kMost; ++i)
        (void)rest.goOn(counts(0, 90, 0, 10), false);
    rest.changed(); // another view begins anew
    CHECK(rest.goOn(counts(0, 90, 0, 10), false));
}

TEST_CASE("at rest all comes back that there is time for, wherever the flight stopped")
{
    for (const double detail : {0.0, 2.0})
        for (int flight = 4; flight < 60; ++flight) {
            CAPTURE(detail);
            CAPTURE(flight);
            FrameGuard guard({10, 0, -8, 0, detail, 4});
            for (int i = 0; i < 20; ++i)
                guard.add(frameMs(5, guard));
            for (int i = 0; i < flight; ++i)
                guard.add(frameMs(30, guard));
            CHECK(guard.gaveUp());
            CHECK(picturesUntilRest(guard, 5) < kNever);
            CHECK_FALSE(guard.gaveUp());
            CHECK(guard.detail() == detail);
            CHECK(guard.lodBias() == 0);
        }
}

TEST_CASE("a view that has no time for it rests all the same, and nothing is given up for good that fits")
{
    FrameGuard guard({10, 0, -8, 0, 0, 4});
    for (int i = 0; i < 200; ++i)
        guard.add(frameMs(30, guard));
    CHECK(picturesUntilRest(guard, 30) <= int(RestPictures::kGiveBack)); // nothing changes
    CHECK(guard.gaveUp());
    CHECK(picturesUntilRest(guard, 15) < kNever); // levels fit and finer detail, everything by itself does not
    CHECK(guard.lodBias() == 0);
    CHECK(guard.detail() >= FrameGuard::kFirstDetail);
    CHECK(frameMs(15, guard) <= 10);
}
