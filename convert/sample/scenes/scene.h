// SPDX-License-Identifier: Apache-2.0
// The sample scenes: their surfaces. A scene is made tile by tile; any tile can be made again by itself. World units
// are metres, z is up.
#pragma once

#include "convert/sample/model/sample_kinds.h"
#include "convert/sample/scenes/surface.h"
#include "convert/survey/camera_view.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct SceneSpec {
    SampleScene scene{};
    uint64_t seed = 0;
    uint32_t side = 1;       // city: blocks per side; street: plots per row of houses; room: tiles per side
    double half_extent = 0;  // half the length of the built part along x
    double horizon = 0;      // radius of the sky dome, 0 = none
    uint32_t main_tiles = 0; // tiles of the built part; the others hold surroundings
    uint32_t tile_count = 0;
    double share[size_t(AnchorShare::Count)] = {1, 0, 0}; // share of the scene's anchors
};

struct Box {
    dvec3 min{}, max{};
};

struct BlobOccluder {
    dvec3 center{}, radii{};
};

struct SceneTile {
    std::vector<Surface> surfaces;
    // objects that cast shadows and darken their surroundings
    std::vector<Box> boxes;
    std::vector<BlobOccluder> blobs;
    bool bounded = false; // anchors of this tile lie in [min, max) of x and y
    double min[2] = {}, max[2] = {};

    // Name for messages; valid until the next call.
    Surface& add(const Surface& surface) { return surfaces.emplace_back(surface); }
};

enum class LotKind { Grass, Paved, Court, Park };

constexpr double kBlockPitch = 60; // metres from crossing to crossing
constexpr double kStreetPlot = 12; // metres of facade per plot

// World direction towards the sun.
dvec3 sunDirection(SampleScene scene);

SceneSpec planScene(SampleScene scene, uint64_t anchors, uint64_t seed);
// Surfaces of the tile and the occluders that stand on it.
void buildTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
// Occluders of other tiles whose shadow may fall on this one.
void addNeighbourOccluders(const SceneSpec& spec, uint32_t tile, SceneTile& out);
// The photographs it was trained with.
std::vector<SourceCamera> sceneCameras(const SceneSpec& spec);
// A camera of the scene: `fov_x` is in degrees.
SourceCamera photograph(dvec3 from, dvec3 to, double fov_x);

// The three scenes behind the functions above. Plans have scene and seed already; tiles are those of the built part.
void planCity(uint64_t anchors, SceneSpec& spec);
void planStreet(uint64_t anchors, SceneSpec& spec);
void planRoom(uint64_t anchors, SceneSpec& spec);
void buildCityTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildStreetTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildRoomTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
std::vector<SourceCamera> cityCameras(const SceneSpec& spec);
std::vector<SourceCamera> streetCameras(const SceneSpec& spec);
std::vector<SourceCamera> roomCameras(const SceneSpec& spec);
double cityRiverY(const SceneSpec& spec); // y of the river's middle; 1e9 if there is none

} // namespace gsc
