// SPDX-License-Identifier: Apache-2.0
// The sample scenes: what stands where. A scene is made tile by tile; any tile can be made again by itself.
// World units are metres, z is up.
#pragma once

#include "convert/sample/sample.h"
#include "convert/sample/scenes/surface.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct SceneSpec {
    SampleScene scene{};
    uint64_t seed = 0;
    uint32_t side = 1;       // city: blocks per side; street: plots per row of houses; room: tiles per side
    double half_extent = 0;  // of the built part, along x
    double horizon = 0;      // radius of the sky dome, 0 = none
    uint32_t main_tiles = 0; // tiles of the built part; the others hold surroundings
    uint32_t tile_count = 0;
    double share[size_t(AnchorShare::Count)] = {1, 0, 0}; // of the anchors
};

// Casts a shadow and darkens what lies close.
struct BoxOccluder {
    double x0, y0, x1, y1, z0, z1;
};

struct BlobOccluder {
    Vec3 center, radii;
};

struct SceneTile {
    std::vector<Surface> surfaces;
    std::vector<BoxOccluder> boxes;
    std::vector<BlobOccluder> blobs;
    size_t own_boxes = 0; // the first of `boxes` stand on this tile
    bool bounded = false; // anchors of this tile lie in [min, max) of x and y
    double min[2] = {}, max[2] = {};
};

struct SampleCamera {
    Vec3 position, forward; // forward is a unit vector
};

struct SceneCameras {
    std::vector<SampleCamera> cameras;
    uint32_t width = 0, height = 0;
    double fov_x = 0; // radians
};

enum class LotKind { Grass, Paved, Court, Park };

constexpr double kBlockPitch = 60; // metres from crossing to crossing
constexpr double kStreetPlot = 12; // metres of facade per plot

// World direction towards the sun.
Vec3 sunDirection(SampleScene scene);

SceneSpec planScene(const SampleOptions& options);
// Surfaces of the tile and the occluders that stand on it.
void buildTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
// Occluders of other tiles whose shadow may fall on this one.
void addNeighbourOccluders(const SceneSpec& spec, uint32_t tile, SceneTile& out);
SceneCameras sceneCameras(const SceneSpec& spec);

// The three scenes behind the functions above.
SceneSpec planCity(const SampleOptions& options);
SceneSpec planStreet(const SampleOptions& options);
SceneSpec planRoom(const SampleOptions& options);
void buildCityTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildStreetTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildRoomTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
SceneCameras cityCameras(const SceneSpec& spec);
SceneCameras streetCameras(const SceneSpec& spec);
SceneCameras roomCameras(const SceneSpec& spec);
double cityRiverY(const SceneSpec& spec); // 1e9 where there is none

} // namespace gsc
