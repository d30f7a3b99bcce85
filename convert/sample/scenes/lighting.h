// SPDX-License-Identifier: Apache-2.0
// Light baked into the colours: sun with soft shadows, sky, and darker corners.
#pragma once

#include "convert/sample/scenes/scene.h"

namespace gsc {

// Occluders that matter for a region, gathered from a tile.
struct NearOccluders {
    std::vector<const Box*> sun_boxes, close_boxes;
    std::vector<const BlobOccluder*> sun_blobs;
};

class SceneLight {
public:
    SceneLight(const SceneSpec& spec, const SceneTile& tile);

    // Occluders of `from` (of the tile if null) that can darken a point within `region`.
    void gather(const Box& region, const NearOccluders* from, NearOccluders& out) const;

    // Irradiance / pi at a point: reflectance times this is the linear colour. `blur` is the width in metres over
    // which the edge of a shadow is softened; `wrap` lets light round the edge of bodies that scatter it.
    [[nodiscard]] dvec3 irradiance(const NearOccluders& near, dvec3 position, dvec3 normal, double blur,
                                   double wrap) const;

private:
    [[nodiscard]] double sunVisibility(const NearOccluders& near, dvec3 position, double blur) const;
    [[nodiscard]] double openness(const NearOccluders& near, dvec3 position, dvec3 normal) const;
    [[nodiscard]] dvec3 roomLight(const NearOccluders& near, dvec3 position, dvec3 normal, double blur) const;

    const SceneSpec& m_spec;
    NearOccluders m_all; // all occluders of the tile
    dvec3 m_sun{};
    double m_top; // height of the highest occluder
};

// The window of the sample room, through which its daylight falls: x = const.
struct RoomWindow {
    double x, y0, y1, z0, z1;
};
constexpr RoomWindow kRoomWindow{3.0, -1.3, 1.1, 0.85, 2.25};
constexpr dvec3 kRoomHalf{3.0, 2.4, 0}; // half width and depth, metres
constexpr double kRoomHeight = 2.7;

// Linear colour as seen to a display value in (0, 1).
dvec3 displayColor(dvec3 linear);

} // namespace gsc
