// SPDX-License-Identifier: Apache-2.0
// A street of houses with shops, trees and parked cars, as seen by someone who walks along it.
#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

constexpr double kWall = 7.6; // metres from the middle of the street to the facades
constexpr double kDepth = 9;  // depth of the houses in metres

} // namespace

void planStreet(uint64_t anchors, SceneSpec& spec)
{
    const double wanted = 9 * std::pow(double(anchors) / 100'000, 0.3);
    spec.side = uint32_t(std::clamp(std::round(wanted), 2.0, 128.0));
    spec.half_extent = 0.5 * kStreetPlot * spec.side;
    spec.horizon = 8 * std::max(spec.half_extent, 60.0);
    spec.main_tiles = 2 * spec.side; // one for each plot on either side of the street
    spec.tile_count = spec.main_tiles + kSurroundingParts;
    spec.share[size_t(AnchorShare::Sky)] = 0.04;
    spec.share[size_t(AnchorShare::Terrain)] = 0.02;
    spec.share[size_t(AnchorShare::Main)] = 0.94;
}

void buildStreetTile(const SceneSpec& spec, uint32_t index, SceneTile& tile)
{
    const int plot = int(index / 2);
    const double side = index % 2 ? -1 : 1;
    const double x0 = plot * kStreetPlot - spec.half_extent, x1 = x0 + kStreetPlot;
    HashRandom random(hashKey(spec.seed, index, 2));
    tile.bounded = true;
    tile.min[0] = x0, tile.max[0] = x1;
    tile.min[1] = side > 0 ? 0 : -spec.half_extent * 16;
    tile.max[1] = side > 0 ? spec.half_extent * 16 : 0;

    // the last plot at either end is a green with trees, which closes the street
    const bool end = plot == 0 || plot + 1 == int(spec.side);
    const double low = side > 0 ? 0 : -kWall, high = side > 0 ? kWall : 0;
    tile.add(makeFlush(rectangle(x0, low, x1, high, 0), Material::StreetGround, {}, hashKey(spec.seed, 3)))
        .reference = {};

    // one or two houses per plot
    double x = x0;
    while (x < x1 - 0.1) {
        const double next = random.chance(0.35) ? x1 : std::min(x1, x + random.between(5.5, 7));
        const double stop = x1 - next < 5 ? x1 : next;
        const double height = 3.3 * double(3 + random.below(3)) + 4.0 + random.between(0.8, 1.4);
        BuildingStyle style = randomStyle(random, std::min(height, 30.0));
        style.facade = FacadeStyle::Punched;
        style.bay = random.between(2.0, 2.8);
        style.window_x = random.between(0.42, 0.52);
        style.window_y = random.between(0.56, 0.66);
        style.shops = true;
        const double front = side * kWall, back = side * (kWall + kDepth);
        const uint64_t seed = random.bits();
        const dvec3 fl{x, front, 0}, fr{stop, front, 0}, bl{x, back, 0}, br{stop, back, 0};
        const dvec3 up{0, 0, height};
        // corners of the facade from left to right as seen from the street
        if (side > 0)
            addFacade(tile, fl, fr, height, style, seed);
        else
            addFacade(tile, fr, fl, height, style, seed);
        tile.surfaces.back().density = 1.6;
        const dvec3 corners[2][2] = {{side > 0 ? bl : fl, side > 0 ? fl : bl},
                                     {side > 0 ? fr : br, side > 0 ? br : fr}};
        for (int i = 0; i < 2; ++i) {
            const dvec3 &a = corners[i][0], &b = corners[i][1];
            tile.add(
                    makeQuad({a, b, b + up, a + up}, Material::Plain, style.wall * 0.9, hashKey(seed, 5 + uint64_t(i))))
                .density = 0.35; // mostly hidden by the next house
        }
        const double y0 = std::min(front, back), y1 = std::max(front, back);
        tile.add(makeQuad(rectangle(x, y0, stop, y1, height - 0.6), Material::FlatRoof, {0.35, 0.33, 0.31},
                          hashKey(seed, 8)))
            .density = 0.3;
        tile.boxes.push_back({{x, y0, 0}, {stop, y1, height}});
        x = stop;
    }
    if (end || plot % 2 == 0)
        addTree(tile, x0 + random.between(4, 8), side * 5.3, random.between(5.5, 7.5), 6, random);
    // cars are parked one behind the other along the kerb
    for (const double along : {3.0, 9.0})
        if (random.chance(0.6))
            addCar(tile, x0 + along + random.between(-0.5, 0.5), side * 3.05, side > 0 ? kPi : 0, random);
    if (end) { // a house across the end of the street
        const double wall_x = plot == 0 ? x0 + 0.05 : x1 - 0.05;
        BuildingStyle style = randomStyle(random, 15);
        style.facade = FacadeStyle::Punched;
        const dvec3 a{wall_x, plot == 0 ? low : high, 0}, b{wall_x, plot == 0 ? high : low, 0};
        addFacade(tile, a, b, 14.5, style, hashKey(spec.seed, 70 + index));
    }
    // a street lamp
    if (plot % 2 == 1) {
        const double lx = x0 + 6, ly = side * 4.7;
        addBox(tile, {{lx - 0.06, ly - 0.06, 0}, {lx + 0.06, ly + 0.06, 5}}, Material::Plain, {0.07, 0.08, 0.08},
               hashKey(spec.seed, 80 + index), 4);
        tile.add(makeEllipsoid({lx, ly, 5.2}, dvec3(0.26), Material::Glow, {1.6, 1.5, 1.25}, index)).density = 3;
    }
}

std::vector<SourceCamera> streetCameras(const SceneSpec& spec)
{
    std::vector<SourceCamera> cameras;
    const double reach = std::min(spec.half_extent - kStreetPlot, 90.0);
    // photographs on either pavement, there and back, at eye height, looking a little towards the other side
    for (int i = 0; i < 48; ++i) {
        const double t = i % 24 / 23.0;
        const bool back = i >= 24;
        const double x = lerp(-0.92, 0.55, t) * reach * (back ? -1 : 1);
        const double y = (back ? 0.9 : -0.9) + 0.5 * std::sin(9 * t);
        const dvec3 from{x, y, 1.75 + 0.15 * std::sin(7 * t)};
        const dvec3 to{x + (back ? -20 : 20), 3.5 * std::sin(5 * t + 0.8), 3.6};
        cameras.push_back(photograph(from, to, 75));
    }
    return cameras;
}

} // namespace gsc
