// SPDX-License-Identifier: Apache-2.0
// Things that stand in the scenes: boxes, houses, trees, cars, surroundings.
#pragma once

#include "convert/sample/model/hash_random.h"
#include "convert/sample/scenes/scene.h"

namespace gsc {

// Five faces (no bottom). No occluder.
void addBox(SceneTile& tile, const Box& box, Material material, dvec3 color, uint64_t seed, double density);
// A box turned by `angle` about the vertical through its centre; its top is shorter by `taper` at either end.
void addTurnedBox(SceneTile& tile, dvec3 center, dvec3 half, double angle, double taper, Material side, dvec3 color,
                  Material top, dvec3 top_color, uint64_t seed, double density);

enum class FacadeStyle { Punched = 0, Ribbon = 1, Curtain = 2 };

struct BuildingStyle {
    FacadeStyle facade = FacadeStyle::Punched;
    dvec3 wall{}, trim{};
    double bay = 3, floor = 3.2, window_x = 0.5, window_y = 0.55;
    bool shops = false;
};

BuildingStyle randomStyle(HashRandom& random, double height);
// Flat-roofed building with parapet and machinery on the roof, and its occluder.
void addBuilding(SceneTile& tile, double x0, double y0, double x1, double y1, double height, const BuildingStyle& style,
                 HashRandom& random);
// One wall of a building: from a to b (seen from outside, left to right), `height` high.
void addFacade(SceneTile& tile, dvec3 a, dvec3 b, double height, const BuildingStyle& style, uint64_t seed);
// House with a tiled gable roof, ridge along x or y.
void addHouse(SceneTile& tile, double x0, double y0, double x1, double y1, double eaves, bool ridge_x,
              HashRandom& random);
// `lobes` 1 is a round crown, more make it irregular.
void addTree(SceneTile& tile, double x, double y, double height, int lobes, HashRandom& random);
void addCar(SceneTile& tile, double x, double y, double angle, HashRandom& random);
// Fields and hills round a square of `half_extent`, and the sky; `part` 0..3 = a side each, 4 = the sky.
constexpr uint32_t kSurroundingParts = 5;
void addSurroundings(const SceneSpec& spec, uint32_t part, SceneTile& tile);

} // namespace gsc
