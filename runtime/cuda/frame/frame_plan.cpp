// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/frame/frame_plan.h"

#include <gsc/error.h>
#include "kernels/frame/device_model.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace gsc {

namespace {

// Shares of a model's Gaussians that a frame may draw. In trained models up to 0.7 of them are kept by their opacity,
// seen from anywhere; of a city with levels a frame draws an eighth.
constexpr double kAliveShare = 0.8, kLevelShare = 0.25;
// memory for this many slots is always planned, if the model has as many Gaussians
constexpr uint64_t kFewSlots = 4u << 20;
constexpr uint64_t kMostSlots = 1u << 30; // limit for the sum of the slots of all lists
constexpr uint64_t kExpectedPairs = 2;    // pairs of splat and bin for which memory is planned, for each slot
// pairs for which memory is planned at least, for each bin: few splats are large
constexpr uint64_t kExpectedLength = 512;
constexpr uint32_t kSeveral = 2; // number of passes for which memory is counted; several need more than one
// least slots of a pass, beside twice the gaps; with fewer there would be too many passes
constexpr uint32_t kLeastSlots = 1u << 12;

uint32_t clamped(uint64_t pairs)
{
    return uint32_t(std::min<uint64_t>(pairs, UINT32_MAX));
}

// Number of slots of one list that hardly any frame of the model exceeds.
uint32_t mostSlots(const FrameRoom& room)
{
    const double share = room.levels ? kLevelShare : kAliveShare;
    const uint64_t expected = std::max(std::min(room.gaussians, kFewSlots), uint64_t(double(room.gaussians) * share));
    const auto slots = uint32_t(std::min(expected, kMostSlots / room.lists));
    return slots + room.gaps(slots, 1);
}

// Pairs of all lists for each slot that memory is planned for if it is short, after a frame of `splats` splats and
// `pairs` pairs.
double pairsPerSlot(const FrameRoom& room, uint64_t splats, uint64_t pairs)
{
    return splats == 0 ? double(kExpectedPairs * room.lists) : std::max(1.25 * double(pairs) / double(splats), 1.0);
}

uint64_t pairsOf(uint32_t slots, double per_slot)
{
    return uint64_t(std::min(double(slots) * per_slot, double(UINT32_MAX)));
}

// Largest number of slots of one list that a frame of the model can need.
uint32_t allSlots(const FrameRoom& room)
{
    const auto slots = uint32_t(std::min<uint64_t>(room.gaussians, kMostSlots / room.lists));
    return slots + room.gaps(slots, 1);
}

bool fits(const FrameRoom& room, const FrameCapacity& capacity, uint32_t passes = kSeveral)
{
    return room.bytes_of(capacity, passes) <= room.bytes;
}

// Returns the best capacity for several passes: the most slots for which there is memory, with their pairs.
FrameCapacity mostOf(const FrameRoom& room, uint32_t visible, double per_slot)
{
    const auto holding = [&](uint32_t slots) {
        return FrameCapacity{visible, slots, uint32_t(pairsOf(slots, per_slot))};
    };
    uint32_t limit = kLeastSlots + 2 * room.gaps(kLeastSlots, kSeveral), too_many = std::max(allSlots(room), limit) + 1;
    while (too_many - limit > 1 + limit / 64) {
        const uint32_t middle = limit + (too_many - limit) / 2;
        (fits(room, holding(middle)) ? limit : too_many) = middle;
    }
    return holding(limit);
}

uint32_t passesOver(const FrameRoom& room, uint64_t splats, uint64_t pairs, const FrameCapacity& most)
{
    const auto passes = [](uint64_t load, uint64_t size) { return (load + size - 1) / size; };
    return uint32_t(std::clamp<uint64_t>(
        std::max(passes(splats, std::max(most.slots - std::min(most.slots, room.gaps(most.slots, kSeveral)), 1u)),
                 passes(pairs, std::max(most.pairs, 1u))),
        1, kMaxPasses));
}

} // namespace

uint32_t slabBits(uint64_t slots)
{
    return uint32_t(std::bit_width(std::clamp<uint64_t>(slots / 16384, 4, kMaxSlabs))) - 1;
}

FrameCapacity plannedCapacity(const FrameRoom& room, const FrameCapacity& now)
{
    const uint64_t share = room.budgeted ? room.bytes : room.bytes / 2;
    const auto holding = [&](uint32_t slots) {
        return FrameCapacity{room.anchors, slots,
                             clamped(std::max(kExpectedPairs * slots * room.lists, kExpectedLength * room.bins))};
    };
    const uint32_t most = mostSlots(room);
    uint32_t slots = room.bytes_of(holding(most), kSeveral) <= share ? most : 0, too_many = most;
    while (too_many > slots && too_many - slots > 1 + slots / 64) {
        const uint32_t middle = slots + (too_many - slots) / 2;
        (room.bytes_of(holding(middle), kSeveral) <= share ? slots : too_many) = middle;
    }
    const FrameCapacity planned = holding(slots);
    if (room.bytes_of(planned, kSeveral) > share)
        return now; // too little memory to plan ahead: frames will grow the buffers to what they need
    const FrameCapacity both{std::max(now.visible, planned.visible), std::max(now.slots, planned.slots),
                             std::max(now.pairs, planned.pairs)};
    return fits(room, both) ? both : planned;
}

uint32_t passesFor(const FrameRoom& room, uint64_t splats, uint64_t pairs, FrameCapacity& capacity)
{
    const uint64_t slots = std::min<uint64_t>(splats + splats / 8, room.gaussians), more_pairs = pairs + pairs / 8;
    const uint64_t wanted = slots + room.gaps(clamped(slots), 1);
    if (more_pairs <= UINT32_MAX && wanted <= allSlots(room)) {
        const FrameCapacity both{capacity.visible, std::max(capacity.slots, uint32_t(wanted)),
                                 std::max(capacity.pairs, uint32_t(more_pairs))};
        if (fits(room, both, 1))
            return 1; // buffers that are too small grow when a frame overflows
        const FrameCapacity load{capacity.visible, uint32_t(wanted), uint32_t(more_pairs)};
        if (splats != 0 && fits(room, load, 1)) {
            capacity = load;
            return 1;
        }
    }
    const FrameCapacity most = mostOf(room, capacity.visible, pairsPerSlot(room, splats, pairs));
    // in one pass a known load does not fit; the smaller gaps of several passes might make it seem to
    const uint32_t least = splats != 0 ? kSeveral : 1,
                   passes = std::max(passesOver(room, slots, more_pairs, most), least);
    // keep a capacity that is good enough: another one needs another graph, which takes the host a millisecond to make
    if (!fits(room, capacity) || (splats != 0 && passesOver(room, slots, more_pairs, capacity) > passes))
        capacity = most;
    return passes;
}

uint32_t grownPasses(const FrameRoom& room, const FrameNeeds& needs, uint32_t passes, FrameCapacity& capacity)
{
    const auto withSlack = [](uint64_t needed) { // the next frame, and the next try of this one, may need a little more
        return needed + needed / 8 + 1024;
    };
    // half more, so that a camera on the move makes it grow only a few times
    const auto half = [](uint64_t needed) { return needed + needed / 2 + 1024; };
    const double per_slot = pairsPerSlot(room, std::min(needs.slots, capacity.slots), needs.pairs);
    if (needs.visible > capacity.visible)
        capacity.visible = uint32_t(std::min<uint64_t>(half(needs.visible), room.anchors));
    const uint64_t all = std::max(allSlots(room), needs.slots);
    for (const bool ample : {true, false}) {
        const uint64_t slots = std::min<uint64_t>(ample ? half(needs.slots) : withSlack(needs.slots), all);
        const uint64_t pairs = ample ? half(needs.pairs) : withSlack(needs.pairs);
        if (needs.pairs > UINT32_MAX || slots > UINT32_MAX)
            continue;
        const FrameCapacity grown{capacity.visible, needs.slots > capacity.slots ? uint32_t(slots) : capacity.slots,
                                  needs.pairs > capacity.pairs ? clamped(pairs) : capacity.pairs};
        if (fits(room, grown)) {
            capacity = grown;
            return passes;
        }
    }
    const FrameCapacity most = mostOf(room, capacity.visible, per_slot);
    if (passes == kMaxPasses) { // all Gaussians lie at one depth, or the budget is far too small
        if (withSlack(needs.pairs) > UINT32_MAX)
            throw Error(
                ErrorCode::OutOfMemory, "cuda",
                formatString("%llu pairs of splat and bin in one pass", static_cast<unsigned long long>(needs.pairs)),
                "fewer than 2^32", "draw smaller images, or draw on the CPU")
                .with({Setting::ImageSize, Setting::CpuBackend});
        capacity.slots = clamped(std::max<uint64_t>(capacity.slots, withSlack(needs.slots)));
        capacity.pairs = clamped(std::max<uint64_t>(capacity.pairs, withSlack(needs.pairs)));
        return passes;
    }
    capacity = most;
    const uint64_t fixed = std::min(needs.slots, room.gaps(most.slots, kSeveral));
    const uint64_t more =
        std::max(passes * withSlack(needs.slots - fixed) /
                     std::max(most.slots - std::min(room.gaps(most.slots, kSeveral), most.slots - 1), 1u),
                 passes * withSlack(needs.pairs) / std::max(most.pairs, 1u)) +
        1;
    return uint32_t(std::min<uint64_t>(std::max<uint64_t>(more, passes + 1), kMaxPasses));
}

void FrameHistory::learn(Outcome& once, const FrameRoom& room, FrameCapacity& capacity)
{
    const Outcome outcome = std::exchange(once, {});
    m_peak = std::max<uint64_t>(m_peak, outcome.needs.slots);
    if (outcome.overflowed) {
        m_grown = grownPasses(room, outcome.needs, outcome.passes, capacity);
    } else {
        m_splats = outcome.splats;
        m_pairs = outcome.pairs;
        m_grown = 1;
    }
}

void FrameHistory::begin(uint64_t ticket, uint64_t repeats, const FrameRoom& room, FrameCapacity& capacity)
{
    Outcome& last_but_one = m_outcomes[ticket % 2];
    if (last_but_one.ticket != 0 && last_but_one.ticket != repeats) {
        try {
            learn(last_but_one, room, capacity);
        } catch (const Error&) {
            // the earlier frame had too little memory and was dropped; this one may need less
        }
    }
    Outcome& repeated = m_outcomes[repeats % 2];
    m_repeats = repeats != 0 && repeated.ticket == repeats;
    if (m_repeats)
        learn(repeated, room, capacity);
}

uint32_t FrameHistory::passes(const FrameRoom& room, FrameCapacity& capacity) const
{
    return m_repeats ? m_grown : std::max(m_grown, passesFor(room, m_splats, m_pairs, capacity));
}

uint32_t FrameHistory::slabBitsFor(const FrameCapacity& capacity) const
{
    const uint64_t load = m_peak > 0 ? m_peak + m_peak / 2 : capacity.slots / 4;
    return slabBits(std::min<uint64_t>(load, capacity.slots));
}

} // namespace gsc
