// SPDX-License-Identifier: Apache-2.0
// Measures the importance of every slot: how much it adds to pictures. It decides which slots a bake may leave out, and
// how coarsely the other values may be rounded.
#pragma once

#include "convert/bake/weights/picture_bands.h"
#include <gsc/frame_types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace gsc {

// Sums over the pixels of all poses. The blend weight w of a slot is transmittance * alpha; if its colour changes by c,
// the squared error grows by c^2 * weight.
struct Importance {
    std::vector<float> weight; // per slot: sum of w^2; 0 = never drawn
    // Per slot: sum of (dw/dx)^2 for a change of position x in world units, averaged over its directions.
    std::vector<float> place;
    std::vector<uint8_t> seen; // per anchor: number of poses that select it
    // per slot: number of places from which its opacity is 1/255 or more, in any direction of view
    std::vector<uint8_t> alive;
    uint32_t poses = 0, places = 0;
};

constexpr uint32_t kMostImportancePoses = 255; // seen and alive are bytes, so no more poses can be counted

// Called from any thread when the arrays of a chunk in the file are not needed for a while.
using ChunkRead = std::function<void(uint32_t chunk)>;

// Measures importance pose by pose with the arithmetic of the CPU renderer; the result does not depend on the number of
// threads. Takes 9 bytes per slot, and the memory of a CPU renderer for the slots of a band of the picture.
class ImportanceMeter {
public:
    // `model` must outlive this. `threads`: 0 = all cores. `read` may be empty. `most_slots`: see pictureBands(); it
    // changes only the order in which doubles are added.
    ImportanceMeter(const ModelView& model, int threads, ChunkRead read = {}, uint64_t most_slots = kMostSlotsAtOnce);
    ~ImportanceMeter();
    ImportanceMeter(const ImportanceMeter&) = delete;
    ImportanceMeter& operator=(const ImportanceMeter&) = delete;

    // Draws the picture of a pose and adds what each slot contributes. Uses level rule, near_z and appearance of
    // `options`. May be called kMostImportancePoses times.
    void add(const EyeParams& eye, const FrameOptions& options);
    // Counts the slots whose opacity reaches 1/255 from a place, whether in view or not. `appearance`: row of the
    // embedding. May be called kMostImportancePoses times.
    void lookFrom(const float (&centre)[3], int32_t appearance);
    // Importance measured so far. Assign the result of an earlier meter of the same model to continue from that.
    [[nodiscard]] Importance& found();
    [[nodiscard]] Importance take() &&;

private:
    struct State;
    std::unique_ptr<State> m_state;
    uint64_t m_most_slots;
};

} // namespace gsc
