// SPDX-License-Identifier: Apache-2.0
// How large the buffers of a frame are made, and into how many passes it is cut. Pure: knows no device.
//
// A frame that finds a buffer too small is drawn again. So the buffers are made for what the model can show before the
// first frame is drawn, where memory allows it. Where it is short they are made for as many Gaussians as half of what is
// free holds, or all that a budget leaves; a frame that needs more takes the rest, and then several passes.
#pragma once

#include <cstdint>
#include <functional>

namespace gsc {

// Entries of the visible list; of a pass: splats of one list, (bin, splat) pairs of all lists.
struct FrameCapacity {
    uint32_t visible = 1u << 13, slots = 1u << 15, pairs = 1u << 16;

    bool operator==(const FrameCapacity&) const = default;
};

// Sizes of a model and a frame, and memory for it, from which a plan is made.
struct FrameRoom {
    uint32_t anchors;     // anchors of the model
    uint64_t gaussians;   // most Gaussians of the model
    uint32_t lists, bins; // lists of splats per bin; bins of the image, of all lists
    uint64_t bytes;       // bytes that frames may take
    bool budgeted;        // `bytes` is a budget, all of it for frames
    bool levels = false;  // the model has levels of detail: a frame shows few of the anchors
    std::function<uint32_t(uint32_t slots, uint32_t passes)> gaps; // slots of a pass that may stay unused among them
    // bytes of the buffers; grows with the capacity, never falls
    std::function<uint64_t(const FrameCapacity&, uint32_t passes)> bytes_of;
};

// Capacity that a frame would have needed, as FrameCapacity counts it.
struct FrameNeeds {
    uint32_t visible, slots;
    uint64_t pairs;
};

// Bits of the number of slabs that bins are cut into: cells of some hundred splats. The order of a bin's list does not
// depend on how it was cut.
uint32_t slabBits(uint64_t slots);

// Capacity to begin with; not less than that of `now`.
FrameCapacity plannedCapacity(const FrameRoom& room, const FrameCapacity& now);

// Passes for a frame with as many splats and pairs as the last, in all passes together. Makes `capacity` smaller if
// there is no memory for it.
uint32_t passesFor(const FrameRoom& room, uint64_t splats, uint64_t pairs, FrameCapacity& capacity);

// After an overflow: raises `capacity`, or the number of passes, to the counted needs; returns the passes. A stage
// after the one that overflowed has seen part of its input only, so this may take several rounds. Throws
// Error(OutOfMemory) where more passes would not help.
uint32_t grownPasses(const FrameRoom& room, const FrameNeeds& needs, uint32_t passes, FrameCapacity& capacity);

// Outcomes of earlier frames that the plan of a frame learns from. With two frames in flight it is never known which of
// them has ended; so that the same frames are cut alike whenever they end, a frame learns from the last but one and
// earlier, and from a frame that it repeats.
class FrameHistory {
public:
    struct Outcome {
        uint64_t ticket = 0; // 0 = none
        FrameNeeds needs{};  // needs of the pass that needed most
        bool overflowed = false;
        uint64_t splats = 0, pairs = 0; // all passes: of the longer list, of all
        uint32_t passes = 1;
    };

    void forget() { *this = {}; } // before the first frame; `capacity` stays

    // A frame ended; before the second one after it begins.
    void add(const Outcome& outcome) { m_outcomes[outcome.ticket % 2] = outcome; }

    // Begins frame `ticket`, which repeats `repeats` if that is not 0; then throws as grownPasses().
    void begin(uint64_t ticket, uint64_t repeats, const FrameRoom& room, FrameCapacity& capacity);
    // Passes of the frame; call after begin() and, if it is due, plannedCapacity(). May make `capacity` smaller
    // (passesFor()).
    [[nodiscard]] uint32_t passes(const FrameRoom& room, FrameCapacity& capacity) const;
    // slabBits() for the load of earlier frames; before the first for a quarter of the capacity.
    [[nodiscard]] uint32_t slabBitsFor(const FrameCapacity& capacity) const;

private:
    void learn(Outcome& outcome, const FrameRoom& room, FrameCapacity& capacity);

    Outcome m_outcomes[2];              // key: ticket
    uint64_t m_splats = 0, m_pairs = 0; // counts of the last frame that did not overflow
    uint64_t m_peak = 0;                // most splats of a pass and a list so far
    uint32_t m_grown = 1;               // passes after the overflow learned from since
    bool m_repeats = false;             // the frame begun repeats the frame it has just learned from
};

} // namespace gsc
