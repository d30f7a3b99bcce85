// SPDX-License-Identifier: Apache-2.0
// A model far from the world's origin, such as a city in metres 100 km away from it, whose positions are made relative
// to a place within it. At 100 km, fp32 has steps of 7.8 mm, and positions, cameras and all differences of them would
// be as coarse. So differences of positions are computed exactly, from integers or in double, before they are rounded
// to fp32; eyeParams() does the same for cameras. The stages need no change: distances, directions and levels stay the
// same.
#pragma once

#include <gsc/frame_types.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace gsc {

// A model counts as far if it is farther from the origin than this many times its own reach. Nearer models keep the
// trainer's positions bit for bit.
constexpr double kFarReaches = 32;

// Returns the middle of a far model: on each axis the median of the groups' positions, each weighing as much as it has
// anchors, so that a few strays do not matter. A model's reach is the median distance of the groups from there, along
// any axis. In world units; each coordinate is an fp32 value, so that subtracting it loses no bit of an fp32 position.
// None if the model is not far.
[[nodiscard]] std::optional<std::array<double, 3>> localOrigin(const ModelView& model);

// A view of `model` with positions and bounds relative to `origin`. It holds the records and 12 bytes for each anchor
// itself, and points into `model` for the rest, which must outlive it. Positions are rounded to fp32 once. Bounds are
// widened by the rounding that the trainer made at the original place.
class LocalModel {
public:
    LocalModel(const ModelView& model, const std::array<double, 3>& origin);
    LocalModel(const LocalModel&) = delete;
    LocalModel& operator=(const LocalModel&) = delete;

    [[nodiscard]] const ModelView& view() const { return m_view; }

private:
    void movePositions(const ModelView& model);

    ModelParams m_params;
    std::vector<LevelRecord> m_levels;
    std::vector<ChunkRecord> m_chunks;
    std::vector<GroupRecord> m_groups;
    std::vector<ChunkArrays> m_arrays;
    std::unique_ptr<float[]> m_positions; // three coordinates for each anchor, in file order
    ModelView m_view;
};

} // namespace gsc
