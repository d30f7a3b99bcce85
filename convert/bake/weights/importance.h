// SPDX-License-Identifier: Apache-2.0
// Importance of every slot (Gaussian of an anchor) to pictures. It decides which slots a bake may leave out, and how
// coarse the values of the others may be.
#pragma once

#include "convert/bake/weights/picture_bands.h"
#include <gsc/frame_types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace gsc {

// Sums over the pixels of all poses. With blend weight w = transmittance * alpha, a change of a slot's colour by c moves
// the pictures by c^2 * weight squared, summed.
struct Importance {
    std::vector<float> weight; // per anchor and slot: sum of w^2; 0 = never draws
    // the same for places: sum of (dw/dx)^2, x a step of a world unit in a direction that is as likely as any other
    std::vector<float> place;
    std::vector<uint8_t> seen;  // per anchor: poses that it is visible in
    std::vector<uint8_t> alive; // per slot: places from where its opacity reaches 1/255, wherever one looks
    uint32_t poses = 0, places = 0;
};

constexpr uint32_t kMostImportancePoses = 255; // that an Importance counts

// Called from any thread, when the arrays of a chunk have been read for now.
using ChunkRead = std::function<void(uint32_t chunk)>;

// Takes poses one by one. Weights are those of the CPU's pictures; the result does not depend on the number of threads. 9
// bytes a slot, and what the renderer of the CPU takes for as many slots as a band may have.
class ImportanceMeter {
public:
    // `model` must outlive this. `threads`: 0 = all cores. `read` may be empty. `most_slots` is that of pictureBands(); with
    // it the order changes in which doubles are summed up, and nothing else.
    ImportanceMeter(const ModelView& model, int threads, ChunkRead read = {}, uint64_t most_slots = kMostSlotsAtOnce);
    ~ImportanceMeter();
    ImportanceMeter(const ImportanceMeter&) = delete;
    ImportanceMeter& operator=(const ImportanceMeter&) = delete;

    // Adds the picture of a pose. Uses the level rule's fields, near_z and the appearance of `options`. At most
    // kMostImportancePoses calls of each, this and lookFrom().
    void add(const EyeParams& eye, const FrameOptions& options);
    // Decodes every anchor from a place: which slots could be alive for someone who stands there?
    void lookFrom(const float (&centre)[3], int32_t appearance);
    // Importance found so far. To go on from the result of another meter of the same model, assign it here.
    [[nodiscard]] Importance& found();
    [[nodiscard]] Importance take() &&;

private:
    struct State;
    std::unique_ptr<State> m_state;
    uint64_t m_most_slots;
};

} // namespace gsc
