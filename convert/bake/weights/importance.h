// SPDX-License-Identifier: Apache-2.0
// Importance of every slot (Gaussian of an anchor): what it adds to pictures. It decides which slots a bake may leave out,
// and how coarse the values of the others may be.
#pragma once

#include "convert/bake/weights/picture_bands.h"
#include <gsc/frame_types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace gsc {

// Sums over the pixels of all poses. With blend weight w = transmittance * alpha, a change of a slot's colour by c adds
// c^2 * weight to the squared error.
struct Importance {
    std::vector<float> weight; // per anchor and slot: sum of w^2; 0 = never draws
    // per anchor and slot, for a change of position: sum of (dw/dx)^2, mean over directions, x in world units
    std::vector<float> place;
    std::vector<uint8_t> seen; // per anchor: number of poses that see it
    std::vector<uint8_t>
        alive; // per slot: number of places from which its opacity is 1/255 or more, in any direction of view
    uint32_t poses = 0, places = 0;
};

constexpr uint32_t kMostImportancePoses = 255; // most poses that an Importance can count

// Called, from any thread, when the arrays of a chunk are not needed for a while.
using ChunkRead = std::function<void(uint32_t chunk)>;

// Measures importance, pose by pose, with the CPU's pictures; the result does not depend on the number of threads. Takes 9
// bytes a slot, and the memory of the CPU renderer for the slots of a band.
class ImportanceMeter {
public:
    // `model` must outlive this. `threads`: 0 = all cores. `read` may be empty. `most_slots`: see pictureBands(); changes
    // only the order in which doubles are added.
    ImportanceMeter(const ModelView& model, int threads, ChunkRead read = {}, uint64_t most_slots = kMostSlotsAtOnce);
    ~ImportanceMeter();
    ImportanceMeter(const ImportanceMeter&) = delete;
    ImportanceMeter& operator=(const ImportanceMeter&) = delete;

    // Adds the picture of a pose. Uses the level rule's fields, near_z and the appearance of `options`. At most
    // kMostImportancePoses calls of this, and as many of lookFrom().
    void add(const EyeParams& eye, const FrameOptions& options);
    // Decodes every anchor from a place, and counts the slots whose opacity reaches 1/255 there.
    void lookFrom(const float (&centre)[3], int32_t appearance);
    // Importance so far. Assign the result of another meter of the same model to continue from it.
    [[nodiscard]] Importance& found();
    [[nodiscard]] Importance take() &&;

private:
    struct State;
    std::unique_ptr<State> m_state;
    uint64_t m_most_slots;
};

} // namespace gsc
