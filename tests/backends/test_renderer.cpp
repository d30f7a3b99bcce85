// SPDX-License-Identifier: Apache-2.0
// The renderer interface: two frames in flight, several renderers of one model.
#include <gsc/error.h>
#include "tests/backends/walk_frames.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <thread>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("renderer: two frames in flight draw what one after the other does, however they are waited for")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    FrameOptions lag = onGrey(Tier::Fast);
    lag.lod_hysteresis = 0.5f;
    std::vector<FrameOptions> ways = {lag};
    for (const ReusePolicy policy : kBackend.policies)
        ways.push_back(with(policy, 2, 2));
    for (const FrameOptions& options : ways) {
        CAPTURE(uint32_t(options.reuse.policy));
        const auto wanted = drawWalk(*open(model.view()), options, 4, How::OneByOne);
        for (const How how : {How::TwoInFlight, How::Polled, How::NewestFirst}) {
            CAPTURE(int(how));
            CHECK(sameWalk(drawWalk(*open(model.view()), options, 4, how), wanted));
        }
    }
}

TEST_CASE("renderer: two on threads of their own, on two devices where there are two, draw the bytes of one")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto all = devices();
    const auto devices_here = int(std::ranges::count_if(
        all, [](const DeviceInfo& device) { return device.usable && device.id.backend == kBackend.name; }));
    const auto on = [&](int ordinal) {
        auto renderer = makeRenderer({kBackend.name, ordinal});
        renderer->load(model.view());
        return renderer;
    };
    CHECK_THROWS_WITH_AS(on(devices_here), doctest::Contains("of its devices"), Error);
    const FrameOptions options = with(kBackend.policies[0], 1, 2);
    const std::vector<Frame> wanted = drawWalk(*on(0), options, 4, How::OneByOne);
    std::vector<Frame> drawn[2];
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&, i] {
            const auto renderer = on(i % devices_here);
            CHECK(renderer->id().ordinal == i % devices_here);
            drawn[i] = drawWalk(*renderer, options, 4, How::TwoInFlight);
        });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(sameWalk(drawn[0], wanted));
    CHECK(sameWalk(drawn[1], wanted));
}
