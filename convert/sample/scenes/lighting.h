// SPDX-License-Identifier: Apache-2.0
// Computes the light that is part of the sample's colours: sun with soft shadows, sky, and darker corners.
#pragma once

#include "convert/sample/scenes/scene.h"

namespace gsc {

// The objects that may shade a region of a tile.
struct NearOccluders {
    std::vector<const Box*> sun_boxes, close_boxes;
    std::vector<const BlobOccluder*> sun_blobs;
};

class SceneLight {
public:
    SceneLight(const SceneSpec& spec, const SceneTile& tile);

    // Sets `out` to the objects of `from` (null = of the whole tile) that can darken a point in `region`.
    void gather(const Box& region, const NearOccluders* from, NearOccluders& out) const;

    // Irradiance / pi at a point, so that reflectance times this is the linear colour. `blur`: width in metres over
    // which the edge of a shadow is soft. `wrap`: 0 to 1, how far light reaches round the edge of a body that scatters
    // it.
    [[nodiscard]] dvec3 irradiance(const NearOccluders& near, dvec3 position, dvec3 normal, double blur,
                                   double wrap) const;

private:
    [[nodiscard]] double sunVisibility(const NearOccluders& near, dvec3 position, double blur) const;
    [[nodiscard]] double openness(const NearOccluders& near, dvec3 position, dvec3 normal) const;
    [[nodiscard]] dvec3 roomLight(const NearOccluders& near, dvec3 position, dvec3 normal, double blur) const;

    const SceneSpec& m_spec;
    NearOccluders m_all; // all objects of the tile that cast shadows
    dvec3 m_sun{};
    double m_top; // height of the highest of them in metres
};

// The window of the sample room, the source of its daylight. It lies in a plane of constant x; metres.
struct RoomWindow {
    double x, y0, y1, z0, z1;
};
constexpr RoomWindow kRoomWindow{3.0, -1.3, 1.1, 0.85, 2.25};
constexpr dvec3 kRoomHalf{3.0, 2.4, 0}; // half of the width and depth of the room in metres
constexpr double kRoomHeight = 2.7;

// Turns a linear colour into display values in (0, 1).
dvec3 displayColor(dvec3 linear);

} // namespace gsc
