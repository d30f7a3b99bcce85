// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/frame/frame_plan.h"

#include <gsc/error.h>
#include "kernels/frame/device_model.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr uint64_t kMiB = 1u << 20, kGiB = 1u << 30;
constexpr uint32_t kGaps = 3000;

// Room of a frame, with about the sizes that the backend has in `fast` for one eye.
FrameRoom roomOf(uint64_t gaussians, uint64_t bytes, bool budgeted, uint64_t image = kMiB, uint32_t gaps = kGaps,
                 uint32_t one_pass_gaps = 0)
{
    FrameRoom room{};
    room.anchors = uint32_t(gaussians / 10);
    room.gaussians = gaussians;
    room.lists = 1;
    room.bins = 400;
    room.bytes = bytes;
    room.budgeted = budgeted;
    room.gaps = [gaps, one_pass_gaps](uint32_t, uint32_t passes) {
        return passes == 1 ? std::max(gaps, one_pass_gaps) : gaps;
    };
    room.bytes_of = [image](const FrameCapacity& c, uint32_t passes) {
        return (passes > 1 ? 2 : 1) * (4 * uint64_t(c.visible) + image) + 76 * uint64_t(c.slots) +
               8 * uint64_t(c.pairs);
    };
    return room;
}

// Content of a frame, however many passes it is drawn in.
struct Load {
    uint32_t visible;
    uint64_t splats, pairs;
};

FrameNeeds needsOf(const Load& load, const FrameRoom& room, uint32_t passes)
{
    const auto part = [passes](uint64_t all) { return (all + passes - 1) / passes; };
    const uint64_t slots = part(load.splats);
    return {load.visible, uint32_t(slots) + room.gaps(uint32_t(slots), passes), part(load.pairs)};
}

bool holds(const FrameCapacity& capacity, const FrameNeeds& needs)
{
    return needs.visible <= capacity.visible && needs.slots <= capacity.slots && needs.pairs <= capacity.pairs;
}

struct Drawn {
    uint32_t passes, repeats;
    bool fits; // in memory, whatever was tried
};

// A frame as the backend draws it: a stage behind one that overflows has seen what fitted alone.
Drawn draw(const Load& load, const FrameRoom& room, FrameCapacity& capacity, const Load& last = {})
{
    Drawn drawn{passesFor(room, last.splats, last.pairs, capacity), 0, true};
    for (;; ++drawn.repeats) {
        drawn.fits = drawn.fits && room.bytes_of(capacity, drawn.passes) <= room.bytes;
        FrameNeeds needs = needsOf(load, room, drawn.passes);
        if (holds(capacity, needs))
            return drawn;
        REQUIRE(drawn.repeats < 40);
        const auto share = [](uint32_t have, uint32_t needed) {
            return std::min(1.0, double(have) / double(std::max(needed, 1u)));
        };
        const double seen = share(capacity.visible, needs.visible);
        needs.slots = uint32_t(needs.slots * seen);
        needs.pairs = uint64_t(double(needs.pairs) * seen * share(capacity.slots, needs.slots));
        drawn.passes = grownPasses(room, needs, drawn.passes, capacity);
        REQUIRE(drawn.passes >= 1);
        REQUIRE(drawn.passes <= kMaxPasses);
    }
}

uint64_t bytesOf(const FrameRoom& room, const FrameCapacity& capacity, uint32_t passes = 1)
{
    return room.bytes_of(capacity, passes);
}

class Rooms { // rooms of any size, small ones as often as large ones
public:
    FrameRoom next(bool budgeted)
    {
        const auto gaps = uint32_t(upTo(1, 300'000));
        const uint64_t gaussians = upTo(10 + gaps / 10, 1u << 30);
        FrameRoom room = roomOf(gaussians, upTo(kMiB, 100 * kGiB), budgeted, upTo(1000, 30 * kMiB), gaps,
                                uint32_t(upTo(1, 8 * gaps)));
        room.bins = uint32_t(upTo(1, 60'000));
        return room;
    }
    uint64_t upTo(uint64_t low, uint64_t high) // evenly in its logarithm
    {
        const double even = double(m_random()) / double(std::mt19937::max());
        return uint64_t(double(low) * std::pow(double(high) / double(low), even));
    }

private:
    std::mt19937 m_random{1};
};

constexpr FrameCapacity kNothing{0, 0, 0};

} // namespace

TEST_CASE("frame plan: with ample memory there is room for most of a model, and for nearly all of a small one")
{
    for (const bool budgeted : {false, true})
        for (const uint64_t gaussians : {1000u, 100'000u, 1'000'000u, 4'000'000u, 30'000'000u, 90'000'000u}) {
            CAPTURE(gaussians);
            const FrameRoom room = roomOf(gaussians, 64 * kGiB, budgeted);
            FrameCapacity capacity = plannedCapacity(room, {});
            const uint64_t least = gaussians <= 4u << 20 ? gaussians / 64 * 63 : gaussians / 4 * 3;
            CHECK(capacity.visible >= room.anchors);
            CHECK(capacity.slots >= least);
            CHECK(capacity.slots <= std::max<uint64_t>(gaussians + kGaps, FrameCapacity{}.slots));
            CHECK(capacity.pairs >= 2 * least);
            CHECK(capacity.pairs >= 512 * room.bins);
            CHECK(bytesOf(room, capacity) < room.bytes / 2);
            const FrameCapacity planned = capacity;
            CHECK(passesFor(room, 0, 0, capacity) == 1);
            CHECK(passesFor(room, gaussians / 2, gaussians, capacity) == 1);
            CHECK(capacity == planned);
            const Load load{room.anchors / 2, gaussians / 2, gaussians};
            const Drawn drawn = draw(load, room, capacity);
            CHECK(drawn.passes == 1);
            CHECK(drawn.repeats == 0);
        }
}

TEST_CASE("frame plan: half of what is free is taken, all of a budget, and nothing where it is too little")
{
    const uint64_t gaussians = 40'000'000;
    const FrameCapacity all = plannedCapacity(roomOf(gaussians, 64 * kGiB, true), {});
    for (const uint64_t bytes : {200 * kMiB, 500 * kMiB, kGiB, 2 * kGiB}) {
        CAPTURE(bytes);
        const FrameRoom free = roomOf(gaussians, bytes, false), budget = roomOf(gaussians, bytes, true);
        const FrameCapacity half = plannedCapacity(free, {}), whole = plannedCapacity(budget, {});
        CHECK(bytesOf(free, half, 2) <= bytes / 2); // several passes may be needed
        CHECK(bytesOf(free, half, 2) > bytes / 2 / 100 * 95);
        CHECK(bytesOf(budget, whole, 2) <= bytes);
        CHECK(bytesOf(budget, whole, 2) > bytes / 100 * 95);
        CHECK(whole.slots < all.slots);
        CHECK(plannedCapacity(roomOf(gaussians, bytes * 2, false), {}) == whole);
    }
    for (const uint64_t bytes : {uint64_t(0), kMiB / 2, 10 * kMiB}) // the visible list alone takes 16 MB
        for (const bool budgeted : {false, true})
            CHECK(plannedCapacity(roomOf(gaussians, bytes, budgeted), {}) == FrameCapacity{});
}

TEST_CASE("frame plan: a model with levels is planned for a quarter of its Gaussians, a small one for all")
{
    FrameRoom room = roomOf(100'000'000, 64 * kGiB, false);
    const uint32_t without = plannedCapacity(room, {}).slots;
    room.levels = true;
    const uint32_t with = plannedCapacity(room, {}).slots;
    CHECK(with >= 25'000'000);
    CHECK(with < 26'000'000);
    CHECK(without >= 80'000'000);
    room.gaussians = 3'000'000;
    CHECK(plannedCapacity(room, {}).slots >= 3'000'000);
}

TEST_CASE("frame plan: what there is already is kept where memory holds it, and planning twice changes nothing")
{
    Rooms rooms;
    for (int i = 0; i < 1000; ++i) {
        const FrameRoom room = rooms.next(i % 2 == 0);
        const FrameCapacity now{uint32_t(rooms.upTo(1, 1u << 30)), uint32_t(rooms.upTo(1, 1u << 30)),
                                uint32_t(rooms.upTo(1, 1u << 31))};
        const FrameCapacity planned = plannedCapacity(room, now);
        const FrameCapacity alone = plannedCapacity(room, FrameCapacity{0, 0, 0});
        const FrameCapacity both{std::max(alone.visible, now.visible), std::max(alone.slots, now.slots),
                                 std::max(alone.pairs, now.pairs)};
        if (room.bytes_of(both, 2) <= room.bytes)
            CHECK(planned == both);
        CHECK(plannedCapacity(room, planned) == planned);
    }
}

TEST_CASE("frame plan: a plan never takes more than its share of any room")
{
    Rooms rooms;
    uint32_t planned_any = 0;
    for (int i = 0; i < 5000; ++i) {
        const FrameRoom room = rooms.next(i % 2 == 0);
        CAPTURE(room.gaussians);
        CAPTURE(room.bytes);
        const FrameCapacity planned = plannedCapacity(room, kNothing);
        planned_any += planned != kNothing;
        if (planned != kNothing)
            CHECK(bytesOf(room, planned) <= room.bytes / (room.budgeted ? 1 : 2));
    }
    CHECK(planned_any > 2000);
}

TEST_CASE("frame plan: a list that is too short grows within memory, and where that is short there are more passes")
{
    const uint64_t gaussians = 10'000'000;
    for (const uint64_t bytes : {100 * kMiB, 300 * kMiB, 600 * kMiB, 2 * kGiB}) {
        CAPTURE(bytes);
        const FrameRoom room = roomOf(gaussians, bytes, false);
        FrameCapacity capacity = plannedCapacity(room, {});
        const FrameCapacity planned = capacity;
        const Load load{room.anchors, 7'000'000, 10'000'000};
        const Drawn first = draw(load, room, capacity), second = draw(load, room, capacity, load);
        CHECK(first.fits);
        CHECK(second.fits);
        CHECK(first.repeats <= 6);
        CHECK(second.repeats == 0);
        const FrameNeeds one = needsOf(load, room, 1);
        const uint64_t needed = 4 * uint64_t(one.visible) + 2 * kMiB + 72 * uint64_t(one.slots) + 8 * one.pairs;
        CHECK(first.passes >= (needed + bytes - 1) / bytes);
        CHECK(first.passes <= 2 * needed / bytes + 2);
        CHECK(capacity.slots >= planned.slots);
        CHECK(holds(capacity, needsOf(load, room, second.passes)));
    }
}

TEST_CASE("frame plan: one pass stays one where memory is free, however many pairs each splat has")
{
    for (const uint64_t pairs_per_splat : {3u, 10u, 100u, 1000u}) {
        CAPTURE(pairs_per_splat);
        const FrameRoom room = roomOf(100'000, 64 * kGiB, false);
        FrameCapacity capacity = plannedCapacity(room, {});
        const Load load{room.anchors, 70'000, 70'000 * pairs_per_splat};
        const Drawn first = draw(load, room, capacity), second = draw(load, room, capacity, load);
        CHECK(first.passes == 1);
        CHECK(first.repeats <= 1);
        CHECK(second.passes == 1);
        CHECK(second.repeats == 0);
        CHECK(bytesOf(room, capacity) < room.bytes);
    }
}

TEST_CASE("frame plan: a walk whose frames show more and more repeats few of them")
{
    FrameRoom room = roomOf(1'000'000, 64 * kGiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    uint32_t repeats = 0;
    Load load{1000, 10'000, 30'000}, last{};
    for (int i = 0; i < 100; ++i) {
        const Drawn drawn = draw(load, room, capacity, last);
        CHECK(drawn.passes == 1);
        repeats += drawn.repeats;
        last = load;
        load.splats = std::min<uint64_t>(load.splats * 11 / 10, 700'000);
        load.pairs = load.pairs * 11 / 10;
    }
    CHECK(load.pairs > 100'000'000);
    CHECK(repeats <= 12);
}

TEST_CASE("frame plan: models and frames of more than 32 bits can count")
{
    FrameRoom room = roomOf(1u << 30, 1024 * kGiB, false);
    for (const uint32_t lists : {1u, 2u}) {
        room.lists = lists;
        const FrameCapacity planned = plannedCapacity(room, {});
        CHECK(uint64_t(planned.slots) * lists <= (1u << 30) + 2 * kGaps);
        CHECK(uint64_t(planned.slots) * lists > 800'000'000);
        CHECK(planned.pairs > 1'600'000'000);
    }
    room = roomOf(uint64_t(1) << 34, 1024 * kGiB, true);
    room.lists = 2;
    CHECK(plannedCapacity(room, {}).slots <= (1u << 29) + kGaps);
    room.bins = UINT32_MAX;
    CHECK(plannedCapacity(room, {}).pairs == UINT32_MAX);

    // so many pairs take passes as long as there are more, and then are refused
    room = roomOf(1u << 30, 1024 * kGiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    uint32_t passes = passesFor(room, 0, 0, capacity);
    const FrameNeeds needs{1000, 1000, uint64_t(1) << 33};
    passes = grownPasses(room, needs, passes, capacity);
    CHECK(passes >= 3);
    CHECK(passes < 6);
    while (passes < kMaxPasses) {
        const uint32_t more = grownPasses(room, needs, passes, capacity);
        REQUIRE(more > passes);
        passes = more;
    }
    const Outcome refused = outcomeOf([&] { (void)grownPasses(room, needs, passes, capacity); });
    CHECK(refused.code == ErrorCode::OutOfMemory);
    CHECK(passesFor(room, 1000, uint64_t(1) << 40, capacity) == kMaxPasses);
}

TEST_CASE("frame plan: what no pass divides is given room at the most passes, whatever memory is left")
{
    const FrameRoom room = roomOf(10'000'000, 40 * kMiB, true);
    FrameCapacity capacity = plannedCapacity(room, {});
    const FrameNeeds needs{1000, 5'000'000, 6'000'000};
    CHECK(grownPasses(room, needs, kMaxPasses, capacity) == kMaxPasses);
    CHECK(capacity.slots >= needs.slots);
    CHECK(capacity.pairs >= needs.pairs); // the allocation says that there is no memory
}

TEST_CASE("frame plan: bits of slabs from four slabs to a thousand")
{
    CHECK(slabBits(0) == 2);
    CHECK(slabBits(1) == 2);
    CHECK(slabBits(8 * 16384 - 1) == 2);
    CHECK(slabBits(8 * 16384) == 3);
    CHECK(slabBits(uint64_t(kMaxSlabs) * 16384 - 1) == 9);
    CHECK(slabBits(uint64_t(kMaxSlabs) * 16384) == 10);
    CHECK(slabBits(UINT32_MAX) == 10);
    CHECK(slabBits(UINT64_MAX) == 10);
    CHECK((1u << slabBits(UINT64_MAX)) == kMaxSlabs);
}

TEST_CASE("frame plan: what was planned is not undone by choosing the passes")
{
    for (uint64_t bytes = 200 * kMiB; bytes < 210 * kMiB; bytes += kMiB / 4)
        for (const bool budgeted : {false, true}) {
            const FrameRoom room = roomOf(40'000'000, bytes, budgeted, 6 * kMiB);
            FrameCapacity capacity = plannedCapacity(room, {});
            const FrameCapacity planned = capacity;
            CHECK(passesFor(room, 0, 0, capacity) == 1);
            CHECK(capacity == planned);
        }
}

TEST_CASE("frame plan: there is room for all of a small model, to the last slot")
{
    const FrameRoom room = roomOf(1'000'000, 64 * kGiB, false);
    CHECK(plannedCapacity(room, {}).slots == 1'000'000 + kGaps);
}

TEST_CASE("frame plan: with ample memory a frame that shows all of a small model takes one pass")
{
    const FrameRoom room = roomOf(1'000'000, 64 * kGiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    CHECK(passesFor(room, 1'000'000, 1'000'000, capacity) == 1);
}

TEST_CASE("frame plan: with ample memory a frame of more than the usual share takes one pass")
{
    const FrameRoom room = roomOf(40'000'000, 64 * kGiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    CHECK(draw({room.anchors, 36'000'000, 40'000'000}, room, capacity).passes == 1);
}

TEST_CASE("frame plan: with ample memory a frame of less than the usual share takes one pass")
{
    const FrameRoom room = roomOf(40'000'000, 64 * kGiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    CHECK(passesFor(room, 28'800'000, 40'000'000, capacity) == 1);
}

TEST_CASE("frame plan: what there was already and the plan together stay within a budget")
{
    FrameRoom room = roomOf(100'000, 82 * kMiB / 10, true, kMiB, 10);
    room.bins = 1200;
    REQUIRE(bytesOf(room, {}, 2) <= room.bytes);
    CHECK(bytesOf(room, plannedCapacity(room, {}), 2) <= room.bytes);
}

TEST_CASE("frame plan: under a budget, four pairs of each splat take more passes and no more memory")
{
    const FrameRoom room = roomOf(40'000'000, 200 * kMiB, true);
    FrameCapacity capacity = plannedCapacity(room, {});
    CHECK(draw({1'000'000, 1'500'000, 6'000'000}, room, capacity).fits);
}

TEST_CASE("frame plan: slots that grow beside many pairs stay within what is free")
{
    const FrameRoom room = roomOf(20'000'000, 400 * kMiB, false);
    FrameCapacity capacity = plannedCapacity(room, {});
    const Load near{10'000, 1'000'000, 15'000'000}, far{200'000, 3'900'000, 5'000'000};
    REQUIRE(draw(near, room, capacity).fits);
    CHECK(draw(far, room, capacity, near).fits);
}

TEST_CASE("frame plan: under a budget, loads that are much alike share a capacity, so that their graphs are kept")
{
    const FrameRoom room = roomOf(40'000'000, 400 * kMiB, true);
    FrameCapacity capacity = plannedCapacity(room, {});
    Load load{1'000'000, 6'000'000, 9'000'000};
    draw(load, room, capacity);
    CHECK(draw(load, room, capacity, load).passes == 2);
    uint32_t changes = 0, passes = 0;
    for (uint64_t step = 0; step < 40; ++step) {
        const Load last = load;
        load.splats += 100'000;
        load.pairs += 160'000 - 8'000 * step; // more of each splat, then fewer
        const FrameCapacity before = capacity;
        const Drawn drawn = draw(load, room, capacity, last);
        CHECK(drawn.repeats == 0);
        changes += capacity != before;
        passes = std::max(passes, drawn.passes);
    }
    CHECK(passes == 3); // it does grow
    CHECK(changes <= 3);
}

TEST_CASE("frame plan: one pass needs no room for what several keep between them")
{
    const Load load{1'000'000, 4'000'000, 6'000'000};
    FrameRoom room = roomOf(10'000'000, 0, true);
    const FrameCapacity need{1'000'000, 4'500'000 + kGaps, 6'750'000};
    room.bytes = bytesOf(room, need, 1) + kMiB;
    REQUIRE(bytesOf(room, need, 2) > room.bytes);
    FrameCapacity capacity{1'000'000, 1'000'000, 2'000'000};
    CHECK(passesFor(room, load.splats, load.pairs, capacity) == 1);
    CHECK(bytesOf(room, capacity, 1) <= room.bytes);
}

// A frame that reuses has a writer more, which a frame of several passes does without.
TEST_CASE("frame plan: where only one pass has many gaps, several are taken, and at once when the load is known")
{
    const FrameRoom room = roomOf(1'440'000, 60 * kMiB, true, kMiB, 10'000, 700'000);
    FrameCapacity capacity = plannedCapacity(room, {});
    const Load load{100'000, 500'000, 700'000};
    const Drawn first = draw(load, room, capacity), next = draw(load, room, capacity, load);
    CHECK(first.fits);
    CHECK(first.passes > 1);
    CHECK(next.fits);
    CHECK(next.passes > 1);
    CHECK(next.repeats == 0);
}

TEST_CASE("frame plan: in rooms and frames of any size")
{
    Rooms rooms;
    uint32_t drawn = 0, unfit = 0, refused = 0;
    for (int i = 0; i < 5000; ++i) {
        const FrameRoom room = rooms.next(i % 2 == 0);
        FrameCapacity capacity = plannedCapacity(room, {});
        Load last{};
        for (int k = 0; k < 4; ++k) {
            const uint64_t splats = rooms.upTo(1, room.gaussians);
            const Load load{uint32_t(rooms.upTo(1, room.anchors)), splats, splats * rooms.upTo(1, 40)};
            const FrameNeeds least = needsOf(load, room, kMaxPasses);
            const auto pairs = uint32_t(std::min<uint64_t>(4 * least.pairs + (1u << 20), UINT32_MAX));
            if (bytesOf(room, {room.anchors, least.slots + 2 * room.gaps(0, 2) + 4096, pairs}, 2) > room.bytes / 2)
                break; // memory may be too little for these
            ++drawn;
            try {
                const bool fits = draw(load, room, capacity, last).fits;
                unfit += !fits;
                if (!fits)
                    break;
            } catch (const Error&) {
                ++refused;
                break;
            }
            last = load;
        }
    }
    CAPTURE(drawn);
    CHECK(drawn > 1000);
    CHECK(unfit == 0);
    CHECK(refused == 0);
}

TEST_CASE("frame plan: a visible list that was too short leaves one pass")
{
    const FrameRoom room = roomOf(100'000, 64 * kGiB, true);
    FrameCapacity capacity; // as after a plan that found too little memory
    CHECK(grownPasses(room, {10'000, 20'000, 40'000}, 1, capacity) == 1);
}

namespace {

// Frames that show more and more, then less; none is repeated. An outcome is told at once, or when the next frame has
// begun. Returns for each frame its number of passes and its capacity.
std::vector<std::pair<uint32_t, FrameCapacity>> plansOf(const FrameRoom& room, bool at_once)
{
    std::vector<std::pair<uint32_t, FrameCapacity>> plans;
    FrameHistory history;
    FrameCapacity capacity = plannedCapacity(room, {});
    FrameHistory::Outcome last;
    for (uint64_t ticket = 1; ticket <= 24; ++ticket) {
        const uint64_t size = ticket < 12 ? ticket : 24 - ticket;
        const Load load{10'000, 150'000 * size, 400'000 * size};
        history.begin(ticket, 0, room, capacity);
        const uint32_t passes = history.passes(room, capacity);
        plans.emplace_back(passes, capacity);
        if (!at_once && last.ticket != 0)
            history.add(last);
        const FrameNeeds needs = needsOf(load, room, passes);
        last = {ticket, needs, !holds(capacity, needs), load.splats, load.pairs, passes};
        if (at_once)
            history.add(last);
    }
    return plans;
}

} // namespace

TEST_CASE("frame history: frames are cut alike whenever those before them end")
{
    const FrameRoom room = roomOf(4'000'000, 60 * kMiB, true);
    const auto early = plansOf(room, true), late = plansOf(room, false);
    CHECK(early == late);
    uint32_t most = 0, least = kMaxPasses;
    for (size_t i = 2; i < early.size(); ++i) {
        most = std::max(most, early[i].first);
        least = std::min(least, early[i].first);
    }
    CHECK(least == 1); // or they would be cut alike by chance
    CHECK(most > 1);
}

TEST_CASE(
    "frame history: what overflowed is learned from by the frame that repeats it, and else by the second after it")
{
    const FrameRoom room = roomOf(4'000'000, 60 * kMiB, true);
    const Load load{10'000, 1'800'000, 5'000'000};
    const auto overflow = [&](uint64_t ticket, uint32_t passes) {
        return FrameHistory::Outcome{ticket, needsOf(load, room, passes), true, 0, 0, passes};
    };
    FrameHistory repeated, dropped;
    FrameCapacity capacity = plannedCapacity(room, {}), other = capacity;
    for (auto [history, room_for] : {std::pair{&repeated, &capacity}, {&dropped, &other}}) {
        history->begin(1, 0, room, *room_for);
        CHECK(history->passes(room, *room_for) == 1);
        history->add(overflow(1, 1));
    }
    repeated.begin(2, 1, room, capacity);
    const uint32_t grown = repeated.passes(room, capacity);
    CHECK(grown > 1);
    CHECK(holds(capacity, needsOf(load, room, grown)));
    dropped.begin(2, 0, room, other);
    CHECK(dropped.passes(room, other) == 1);
    dropped.begin(3, 0, room, other);
    CHECK(dropped.passes(room, other) == grown);
    CHECK(other == capacity);
    // until a frame that did not overflow says how many it takes
    repeated.add({2, needsOf({10'000, 1000, 1000}, room, grown), false, 1000, 1000, grown});
    repeated.begin(3, 0, room, capacity);
    CHECK(repeated.passes(room, capacity) == grown);
    repeated.begin(4, 0, room, capacity);
    CHECK(repeated.passes(room, capacity) == 1);
    // what no memory holds is an error of the frame that repeats it, and of no other
    FrameNeeds endless = needsOf(load, room, 1);
    endless.pairs = uint64_t(1) << 40;
    repeated.add({5, endless, true, 0, 0, kMaxPasses});
    CHECK_THROWS_AS(repeated.begin(6, 5, room, capacity), Error);
    repeated.add({5, endless, true, 0, 0, kMaxPasses});
    CHECK_NOTHROW(repeated.begin(7, 0, room, capacity));
    repeated.forget();
    CHECK(repeated.slabBitsFor(capacity) == slabBits(capacity.slots / 4));
}
