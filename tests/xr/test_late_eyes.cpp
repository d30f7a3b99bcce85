// SPDX-License-Identifier: Apache-2.0
// When a picture is seen, and that eyes are looked up once for each.
#include "player/xr/late_eyes.h"

#include <gsc/error.h>

#include <doctest/doctest.h>

#include <latch>
#include <thread>

using namespace gsc;

namespace {

using namespace std::chrono_literals;

const SpaceEye kEye = {{}, -0.5, 0.5, 0.5, -0.5};

class ScriptedHeadset final : public Headset {
public:
    [[nodiscard]] const HeadsetFacts& facts() const override { return m_facts; }
    [[nodiscard]] bool sharesMemory() const override { return false; }
    SharedBlock makeShared(size_t) override { return {}; }
    int semaphoreFile() override { return -1; }
    void importerGone() override {}
    void freeShared(uint32_t) override {}
    void prepare() override {}
    HeadsetState poll() override { return HeadsetState::Running; }
    bool spaceMoved() override { return false; }
    [[nodiscard]] const HiddenMesh& hidden(size_t) const override { return m_mesh; }
    bool hiddenChanged() override { return false; }
    int64_t now() override { return 0; }
    void requestExit() override {}
    HeadsetFrame beginFrame() override { return {}; }
    bool locate(int64_t time, std::vector<SpaceEye>& eyes) override
    {
        asked.push_back(time);
        if (begun)
            begun->count_down();
        if (goes_on)
            goes_on->wait();
        if (fails)
            throw Error(ErrorCode::Device, "headset", "gone", "it to stay", "start again");
        if (tracked) {
            eyes.assign(2, kEye);
            eyes[0].pose.position.x = double(time);
        }
        return tracked;
    }
    HeadsetInput input(int64_t) override { return {}; }
    void take(const HeadsetPictures&) override {}
    void endFrame(bool) override {}
    void finish() override {}
    [[nodiscard]] double copyMs() const override { return 0; }

    bool tracked = true, fails = false;
    std::vector<int64_t> asked;
    std::latch *begun = nullptr, *goes_on = nullptr; // a runtime that takes its time

private:
    HiddenMesh m_mesh;
    HeadsetFacts m_facts;
};

} // namespace

TEST_CASE("a picture is seen with the first refresh whose frame finds it drawn")
{
    const std::chrono::steady_clock::time_point woken{};
    const auto seen = [&](auto after, auto draws) { return seenAt(woken + after, draws, woken, 1000000, 10000000); };
    CHECK(seen(0ms, 0ms) == 1000000); // there at once
    CHECK(seen(1ms, 5ms) == 11000000);
    CHECK(seen(4ms, 6ms) == 11000000); // just there when the loop wakes up
    CHECK(seen(4ms, 7ms) == 21000000);
    CHECK(seen(9ms, 25ms) == 41000000);
    CHECK(seen(35ms, 1ms) == 41000000);                                   // a loop that was held up
    CHECK(seenAt(woken + 4ms, 7ms, woken, 1000000, 0) == 1000000);        // a runtime that knows no period
    CHECK(seenAt(woken - 1ms, 0ms, woken, 1000000, 10000000) == 1000000); // woken meanwhile
    CHECK(seenAt(woken + 1ms, 0ms, woken, INT64_MAX / 2, 10000000) > 0);
}

TEST_CASE("eyes are looked up once for a picture, and not behind the end")
{
    ScriptedHeadset headset;
    LateEyes late(headset, true);
    late.woke({}, {70, 10, true});
    const std::vector<SpaceEye> two(2, kEye);
    LateLook look;
    CHECK(late.find(look, two));
    CHECK(late.find(look, two)); // the second pair of four views
    CHECK(headset.asked == std::vector<int64_t>{70});
    CHECK(look.time == 70);
    REQUIRE(look.eyes.size() == 2);
    CHECK(look.eyes[0].pose.position.x == 70);

    LateLook other;
    CHECK_FALSE(late.find(other, std::vector<SpaceEye>(4, kEye))); // not the views that were asked for
    headset.tracked = false;
    LateLook lost;
    CHECK_FALSE(late.find(lost, two));
    headset.fails = true;
    LateLook gone;
    CHECK_FALSE(late.find(gone, two));
    late.stop();
    LateLook after;
    CHECK_FALSE(late.find(after, two));
    CHECK(headset.asked.size() == 4);
}

TEST_CASE("the frame loop does not wait for a runtime that is slow to say where eyes are")
{
    ScriptedHeadset headset;
    std::latch begun(1), goes_on(1);
    headset.begun = &begun;
    headset.goes_on = &goes_on;
    LateEyes late(headset, true);
    late.woke({}, {70, 10, true});
    LateLook look;
    std::jthread worker([&] { late.find(look, std::vector<SpaceEye>(2, kEye)); });
    begun.wait();
    late.woke({}, {80, 10, true});
    late.drew(1);
    goes_on.count_down();
    worker.join();
    CHECK(look.time == 70);
}

TEST_CASE("eyes are looked up for when their picture will be seen, and for the lenses that were asked with")
{
    ScriptedHeadset headset;
    LateEyes late(headset, false);
    constexpr int64_t kPeriod = 1000000000;
    const std::vector<SpaceEye> two(2, kEye);
    late.woke(std::chrono::steady_clock::now(), {kPeriod, kPeriod, true});
    LateLook quick;
    CHECK(late.find(quick, two));
    CHECK(quick.time == 2 * kPeriod); // nothing is known of how long pictures take
    late.drew(1500);
    late.woke(std::chrono::steady_clock::now(), {kPeriod, kPeriod, true});
    LateLook slow;
    CHECK(late.find(slow, two));
    CHECK(slow.time == 3 * kPeriod);
    late.drew(4000); // a fifth of the way from 1500
    late.woke(std::chrono::steady_clock::now(), {kPeriod, kPeriod, true});
    LateLook slower;
    CHECK(late.find(slower, two));
    CHECK(slower.time == 4 * kPeriod);
    std::vector<SpaceEye> wider = two;
    wider[1].right = 0.6;
    LateLook other;
    CHECK_FALSE(late.find(other, wider));
}
