// SPDX-License-Identifier: Apache-2.0
// Objects of the scenes: boxes, houses, trees, cars, surroundings.
#pragma once

#include "convert/sample/model/hash_random.h"
#include "convert/sample/scenes/scene.h"

namespace gsc {

// Adds a box without its bottom. It casts no shadow.
void addBox(SceneTile& tile, const Box& box, Material material, dvec3 color, uint64_t seed, double density);
// Adds a box turned by `angle` radians about the vertical axis through its centre. Its top is shorter by `taper` metres
// at either end.
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
// Adds a building with a flat roof, a parapet and machines on the roof. It casts a shadow.
void addBuilding(SceneTile& tile, double x0, double y0, double x1, double y1, double height, const BuildingStyle& style,
                 HashRandom& random);
// Adds one wall of a building from `a` to `b` (left to right as seen from outside), `height` metres high.
void addFacade(SceneTile& tile, dvec3 a, dvec3 b, double height, const BuildingStyle& style, uint64_t seed);
// Adds a house with a tiled gable roof, whose ridge runs along x or y.
void addHouse(SceneTile& tile, double x0, double y0, double x1, double y1, double eaves, bool ridge_x,
              HashRandom& random);
// Adds a tree. `lobes`: 1 = a round crown, more = an irregular one.
void addTree(SceneTile& tile, double x, double y, double height, int lobes, HashRandom& random);
void addCar(SceneTile& tile, double x, double y, double angle, HashRandom& random);
// Adds a side of the fields and hills round a square of half_extent (`part` 0 to 3), or the sky (4).
constexpr uint32_t kSurroundingParts = 5;
void addSurroundings(const SceneSpec& spec, uint32_t part, SceneTile& tile);

} // namespace gsc
