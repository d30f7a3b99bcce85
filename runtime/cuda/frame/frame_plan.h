// SPDX-License-Identifier: Apache-2.0
// Plans the sizes of a frame's buffers and the number of passes that a frame is drawn in. Needs no device.
//
// A frame that finds a buffer too small is drawn again. So before the first frame the buffers are made large enough
// for what the model can show, if memory allows. If memory is short, they are made for as many Gaussians as fit into
// half of the free memory, or into all of a budget. A frame that needs more takes the rest of the memory, and then
// several passes.
#pragma once

#include <cstdint>
#include <functional>

namespace gsc {

// Capacity of buffers: entries of the visible list; splats of one list in a pass; pairs of all lists in a pass.
struct FrameCapacity {
    uint32_t visible = 1u << 13, slots = 1u << 15, pairs = 1u << 16;

    bool operator==(const FrameCapacity&) const = default;
};

// Sizes of a model and a frame, and the memory for the frame's buffers; a plan is made from them.
struct FrameRoom {
    uint32_t anchors;     // number of anchors of the model
    uint64_t gaussians;   // largest number of Gaussians of the model
    uint32_t lists, bins; // lists of splats for each bin (1 or one for each eye); number of bins in all lists
    uint64_t bytes;       // bytes of memory that the buffers of frames may take
    bool budgeted;        // `bytes` is a budget set by the user, and frames may take all of it
    bool levels = false;  // the model has levels of detail, so a frame shows only some of the anchors
    // number of slots of a pass that may stay unused, between slots in use
    std::function<uint32_t(uint32_t slots, uint32_t passes)> gaps;
    // bytes of the buffers for a capacity; a larger capacity never gives fewer
    std::function<uint64_t(const FrameCapacity&, uint32_t passes)> bytes_of;
};

// Capacity that a frame would have needed, counted as in FrameCapacity.
struct FrameNeeds {
    uint32_t visible, slots;
    uint64_t pairs;
};

// Logarithm to base 2 of the number of slabs, chosen so that a depth cell holds some hundred splats. The order of a
// bin's splats does not depend on it.
uint32_t slabBits(uint64_t slots);

// Returns the capacity for the first frames; not less than `now` if that fits.
FrameCapacity plannedCapacity(const FrameRoom& room, const FrameCapacity& now);

// Returns the number of passes for a frame that has `splats` splats and `pairs` pairs in all passes together. Makes
// `capacity` smaller if there is not enough memory for it.
uint32_t passesFor(const FrameRoom& room, uint64_t splats, uint64_t pairs, FrameCapacity& capacity);

// After an overflow: raises `capacity` to the counted needs, or the number of passes, which it returns. The stages
// behind the one that overflowed saw only a part of their input, so this may take several tries. Throws
// Error(OutOfMemory) if more passes would not help.
uint32_t grownPasses(const FrameRoom& room, const FrameNeeds& needs, uint32_t passes, FrameCapacity& capacity);

// Outcomes of earlier frames, from which the next frame is planned. With two frames in flight it is not known which of
// them has ended. A plan therefore uses only the last frame but one, those before it, and a frame that is repeated: so
// the same sequence of frames always gets the same plans.
class FrameHistory {
public:
    struct Outcome {
        uint64_t ticket = 0; // ticket of the frame, 0 = none
        FrameNeeds needs{};  // buffer sizes that the pass with the largest needs would have needed
        bool overflowed = false;
        uint64_t splats = 0, pairs = 0; // sums over all passes: splats of the longer list; pairs of all lists
        uint32_t passes = 1;
    };

    void forget() { *this = {}; } // call before the first frame of a model; keeps `capacity`

    // Adds the outcome of a frame that has ended. Call it before the second frame after that one begins.
    void add(const Outcome& outcome) { m_outcomes[outcome.ticket % 2] = outcome; }

    // Begins frame `ticket`, which repeats frame `repeats` if that is not 0. Throws as grownPasses() does in that
    // case.
    void begin(uint64_t ticket, uint64_t repeats, const FrameRoom& room, FrameCapacity& capacity);
    // Returns the number of passes of the frame. Call it after begin() and, if it is due, plannedCapacity(). May make
    // `capacity` smaller, as passesFor() does.
    [[nodiscard]] uint32_t passes(const FrameRoom& room, FrameCapacity& capacity) const;
    // Returns slabBits() for the splats of earlier frames; before the first frame, for a quarter of the capacity.
    [[nodiscard]] uint32_t slabBitsFor(const FrameCapacity& capacity) const;

private:
    void learn(Outcome& outcome, const FrameRoom& room, FrameCapacity& capacity);

    Outcome m_outcomes[2];              // outcomes of the last two frames; index: ticket % 2
    uint64_t m_splats = 0, m_pairs = 0; // splats and pairs of the last frame that did not overflow
    uint64_t m_peak = 0;                // most splats of one list in one pass so far
    uint32_t m_grown = 1;               // number of passes after the last overflow; 1 after a frame without one
    bool m_repeats = false;             // the current frame repeats the frame whose outcome was learned last
};

} // namespace gsc
