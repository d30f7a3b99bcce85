// SPDX-License-Identifier: Apache-2.0
// The sample scenes as lists of surfaces. A scene is made tile by tile, and any tile can be made by itself. World units
// are metres, z points up.
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
    // city: blocks per side; street: plots per row of houses; room: tiles per side
    uint32_t side = 1;
    double half_extent = 0;  // half of the length of the built part along x
    double horizon = 0;      // radius of the sky dome; 0 = no sky
    uint32_t main_tiles = 0; // tiles of the built part; later tiles hold the surroundings
    uint32_t tile_count = 0;
    double share[size_t(AnchorShare::Count)] = {1, 0, 0}; // share of the anchors that each AnchorShare gets
};

struct Box {
    dvec3 min{}, max{};
};

struct BlobOccluder {
    dvec3 center{}, radii{};
};

struct SceneTile {
    std::vector<Surface> surfaces;
    // Objects that cast shadows and darken what is near them.
    std::vector<Box> boxes;
    std::vector<BlobOccluder> blobs;
    bool bounded = false; // the anchors of this tile lie in [min, max) in x and y
    double min[2] = {}, max[2] = {};

    // Adds a surface. The reference is valid until the next call.
    Surface& add(const Surface& surface) { return surfaces.emplace_back(surface); }
};

enum class LotKind { Grass, Paved, Court, Park };

constexpr double kBlockPitch = 60; // metres from one crossing to the next
constexpr double kStreetPlot = 12; // metres of facade per plot

// Direction towards the sun, in world space.
dvec3 sunDirection(SampleScene scene);

SceneSpec planScene(SampleScene scene, uint64_t anchors, uint64_t seed);
// Makes the surfaces of a tile and the objects on it that cast shadows.
void buildTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
// Adds objects of other tiles whose shadows may fall on this tile.
void addNeighbourOccluders(const SceneSpec& spec, uint32_t tile, SceneTile& out);
// The photographs that the sample pretends to be trained with.
std::vector<SourceCamera> sceneCameras(const SceneSpec& spec);
// A camera at `from` that looks at `to`. `fov_x`: horizontal angle of view in degrees.
SourceCamera photograph(dvec3 from, dvec3 to, double fov_x);

// Implementations of the functions above for each scene. Before a plan function, scene and seed are set in `spec`;
// tiles are those of the built part.
void planCity(uint64_t anchors, SceneSpec& spec);
void planStreet(uint64_t anchors, SceneSpec& spec);
void planRoom(uint64_t anchors, SceneSpec& spec);
void buildCityTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildStreetTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
void buildRoomTile(const SceneSpec& spec, uint32_t tile, SceneTile& out);
std::vector<SourceCamera> cityCameras(const SceneSpec& spec);
std::vector<SourceCamera> streetCameras(const SceneSpec& spec);
std::vector<SourceCamera> roomCameras(const SceneSpec& spec);
double cityRiverY(const SceneSpec& spec); // y of the river's middle in metres; 1e9 if there is no river

} // namespace gsc
