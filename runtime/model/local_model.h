// SPDX-License-Identifier: Apache-2.0
// A model far from the world's origin, such as a city in metres 100 km away from it, read relative to a place within.
// fp32 steps by 7.8 mm at 100 km, so positions, cameras and every difference of the two would be as coarse there.
// Differences of positions are taken where they are exact, from integers or in double, before they are rounded to fp32;
// cameras follow in eyeParams(). The stages notice nothing: distances, directions and levels do not depend on it.
#pragma once

#include <gsc/frame_types.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace gsc {

// A model farther from the origin than this many times its own reach is read relative to its middle; a nearer one as
// the trainer reads it, bit for bit.
constexpr double kFarReaches = 32;

// The middle of a far model: per axis the median of its anchors by group, whatever a few strays do to its bounds. A
// model's reach is how far the median group goes from there, along any axis. World units, each an fp32 value, so that no
// fp32 position loses a bit by the difference. Empty if the model is not far.
[[nodiscard]] std::optional<std::array<double, 3>> localOrigin(const ModelView& model);

// A view of `model` with positions and bounds relative to `origin`. It holds the records and 12 bytes per anchor itself
// and points to `model`'s for the rest, so that must outlive it. Positions are rounded to fp32 once; bounds are widened
// by the trainer's own rounding of a position at its old place.
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
    std::unique_ptr<float[]> m_positions; // anchors x 3, file order
    ModelView m_view;
};

} // namespace gsc
