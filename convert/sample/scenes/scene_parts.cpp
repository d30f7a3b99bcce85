// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

constexpr double kParapet = 0.9; // metres above the roof

// Adds the four walls of a building, which stand on the ground.
void addWalls(SceneTile& tile, double x0, double y0, double x1, double y1, double height, const BuildingStyle& style,
              uint64_t seed)
{
    const Corners p = rectangle(x0, y0, x1, y1, 0);
    for (size_t i = 0; i < 4; ++i)
        addFacade(tile, p[i], p[(i + 1) % 4], height, style, hashKey(seed, i));
}

} // namespace

void addBox(SceneTile& tile, const Box& box, Material material, dvec3 color, uint64_t seed, double density)
{
    const dvec3 &low = box.min, &high = box.max, up{0, 0, high.z - low.z};
    const Corners p = rectangle(low.x, low.y, high.x, high.y, low.z);
    const auto face = [&](const Corners& corners, uint64_t part) {
        tile.add(makeQuad(corners, material, color, hashKey(seed, part))).density = density;
    };
    for (size_t i = 0; i < 4; ++i) {
        const dvec3 a = p[i], b = p[(i + 1) % 4];
        face({a, b, b + up, a + up}, i);
    }
    face(rectangle(low.x, low.y, high.x, high.y, high.z), 9);
}

void addTurnedBox(SceneTile& tile, dvec3 center, dvec3 half, double angle, double taper, Material side, dvec3 color,
                  Material top, dvec3 top_color, uint64_t seed, double density)
{
    const dvec3 ahead{std::cos(angle), std::sin(angle), 0}, left{-std::sin(angle), std::cos(angle), 0};
    const auto corner = [&](double sx, double sy, double length, double z) {
        return center + ahead * (sx * length) + left * (sy * half.y) + dvec3{0, 0, z};
    };
    Corners low, high;
    const double sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, -1, 1, 1};
    for (size_t i = 0; i < 4; ++i) {
        low[i] = corner(sx[i], sy[i], half.x, -half.z);
        high[i] = corner(sx[i], sy[i], half.x - taper, half.z);
    }
    const auto face = [&](const Corners& corners, Material material, dvec3 tone, uint64_t part) {
        tile.add(makeQuad(corners, material, tone, hashKey(seed, part))).density = density;
    };
    for (size_t i = 0; i < 4; ++i)
        face({low[i], low[(i + 1) % 4], high[(i + 1) % 4], high[i]}, side, color, i);
    face(high, top, top_color, 9);
}

BuildingStyle randomStyle(HashRandom& random, double height)
{
    // reflectance of plaster, brick and stone
    static constexpr dvec3 kWalls[] = {{0.56, 0.45, 0.30}, {0.50, 0.34, 0.21}, {0.36, 0.12, 0.07}, {0.58, 0.52, 0.43},
                                       {0.44, 0.20, 0.11}, {0.54, 0.38, 0.23}, {0.36, 0.36, 0.34}, {0.55, 0.45, 0.36},
                                       {0.27, 0.14, 0.09}, {0.58, 0.48, 0.26}};
    BuildingStyle style;
    style.wall = kWalls[random.below(10)] * random.between(0.9, 1.1);
    style.trim = lerp(style.wall, {0.75, 0.72, 0.66}, 0.6);
    const double pick = random.unit();
    if (height > 35) {
        style.facade = pick < 0.6 ? FacadeStyle::Curtain : FacadeStyle::Ribbon;
        if (pick > 0.85)
            style.facade = FacadeStyle::Punched;
    } else {
        style.facade = pick < 0.75 ? FacadeStyle::Punched : FacadeStyle::Ribbon;
    }
    style.floor = random.between(3.1, 3.6);
    switch (style.facade) {
    case FacadeStyle::Punched:
        style.bay = random.between(2.6, 3.6);
        style.window_x = random.between(0.42, 0.56);
        style.window_y = random.between(0.5, 0.62);
        break;
    case FacadeStyle::Ribbon:
        style.bay = random.between(3.5, 5);
        style.window_x = 0.93;
        style.window_y = random.between(0.45, 0.55);
        style.wall = lerp(style.wall, {0.5, 0.5, 0.5}, 0.4);
        break;
    case FacadeStyle::Curtain:
        style.bay = random.between(1.6, 2.6);
        style.window_x = 0.9;
        style.window_y = 0.84;
        style.wall = lerp({0.16, 0.18, 0.20}, {0.5, 0.52, 0.54}, random.unit());
        style.trim = style.wall;
        break;
    }
    style.shops = height < 35 ? random.chance(0.7) : true;
    return style;
}

void addFacade(SceneTile& tile, dvec3 a, dvec3 b, double height, const BuildingStyle& style, uint64_t seed)
{
    const dvec3 up{0, 0, height};
    Surface& s = tile.add(makeQuad({a, b, b + up, a + up}, Material::Facade, style.wall, seed));
    const double width = length(b - a);
    s.accent = style.trim;
    s.param[0] = width / std::max(1.0, std::round(width / style.bay));
    s.param[1] = style.floor;
    s.param[2] = style.window_x;
    s.param[3] = style.window_y;
    s.param[4] = double(style.facade);
    s.param[5] = style.shops ? 1 : 0;
    s.density = 1.3; // windows have the finest detail of the scene
}

void addBuilding(SceneTile& tile, double x0, double y0, double x1, double y1, double height, const BuildingStyle& style,
                 HashRandom& random)
{
    const uint64_t seed = random.bits();
    addWalls(tile, x0, y0, x1, y1, height, style, seed);
    const double roof_z = height - kParapet;
    const double tone = random.between(0.25, 0.5);
    const bool green = random.chance(0.15);
    tile.add(makeQuad(rectangle(x0, y0, x1, y1, roof_z), Material::FlatRoof,
                      green ? dvec3{0.16, 0.26, 0.08} : dvec3{tone, tone * 0.97, tone * 0.92}, hashKey(seed, 7)));
    tile.boxes.push_back({{x0, y0, 0}, {x1, y1, height}});

    const double wx = x1 - x0, wy = y1 - y0;
    const uint32_t units = wx * wy > 60 ? 1 + random.below(3) : 0;
    for (uint32_t i = 0; i < units; ++i) {
        const double hx = random.between(1, std::min(2.6, wx * 0.15)), hy = random.between(1, std::min(2.6, wy * 0.15));
        const double cx = random.between(x0 + hx + 1, x1 - hx - 1), cy = random.between(y0 + hy + 1, y1 - hy - 1);
        const double top = roof_z + random.between(1.2, 2.8);
        const dvec3 grey = dvec3{0.5, 0.5, 0.5} * random.between(0.7, 1.1);
        const Box unit{{cx - hx, cy - hy, roof_z}, {cx + hx, cy + hy, top}};
        addBox(tile, unit, Material::Plain, grey, hashKey(seed, 20 + i), 1);
        tile.boxes.push_back(unit);
    }
}

void addHouse(SceneTile& tile, double x0, double y0, double x1, double y1, double eaves, bool ridge_x,
              HashRandom& random)
{
    const uint64_t seed = random.bits();
    static constexpr dvec3 kRoofs[] = {{0.46, 0.15, 0.08}, {0.38, 0.12, 0.07}, {0.30, 0.13, 0.09}, {0.20, 0.17, 0.16}};
    BuildingStyle style;
    style.wall = lerp({0.72, 0.66, 0.55}, {0.55, 0.40, 0.28}, random.unit());
    style.trim = style.wall;
    style.bay = random.between(2.8, 3.6);
    style.floor = eaves / std::max(1.0, std::round(eaves / 2.9));
    style.window_x = 0.4;
    style.window_y = 0.45;
    addWalls(tile, x0, y0, x1, y1, eaves, style, seed);

    const dvec3 roof_color = kRoofs[random.below(4)] * random.between(0.85, 1.2);
    const double span = ridge_x ? y1 - y0 : x1 - x0;
    const double rise = span * 0.5 * random.between(0.7, 0.95);
    constexpr double kOverhang = 0.5;
    const double drop = kOverhang * rise / (span * 0.5); // the eaves lie below the top of the wall
    const double mid_x = 0.5 * (x0 + x1), mid_y = 0.5 * (y0 + y1), top = eaves + rise;
    const auto slope = [&](dvec3 a, dvec3 b, dvec3 c, dvec3 d, uint64_t part) {
        tile.add(makeQuad({a, b, c, d}, Material::TileRoof, roof_color, hashKey(seed, part))).density = 1.1;
    };
    const auto gable = [&](dvec3 a, dvec3 b, dvec3 tip, uint64_t part) {
        tile.add(makeQuad({a, b, tip, tip}, Material::Plain, style.wall, hashKey(seed, part)));
    };
    const double low = eaves - drop;
    if (ridge_x) {
        const double a = x0 - kOverhang, b = x1 + kOverhang;
        slope({a, y0 - kOverhang, low}, {b, y0 - kOverhang, low}, {b, mid_y, top}, {a, mid_y, top}, 10);
        slope({b, y1 + kOverhang, low}, {a, y1 + kOverhang, low}, {a, mid_y, top}, {b, mid_y, top}, 11);
        gable({x1, y0, eaves}, {x1, y1, eaves}, {x1, mid_y, top}, 12);
        gable({x0, y1, eaves}, {x0, y0, eaves}, {x0, mid_y, top}, 13);
    } else {
        const double a = y0 - kOverhang, b = y1 + kOverhang;
        slope({x1 + kOverhang, a, low}, {x1 + kOverhang, b, low}, {mid_x, b, top}, {mid_x, a, top}, 10);
        slope({x0 - kOverhang, b, low}, {x0 - kOverhang, a, low}, {mid_x, a, top}, {mid_x, b, top}, 11);
        gable({x0, y0, eaves}, {x1, y0, eaves}, {mid_x, y0, top}, 12);
        gable({x1, y1, eaves}, {x0, y1, eaves}, {mid_x, y1, top}, 13);
    }
    tile.boxes.push_back({{x0, y0, 0}, {x1, y1, eaves + 0.5 * rise}});
}

void addTree(SceneTile& tile, double x, double y, double height, int lobes, HashRandom& random)
{
    const uint64_t seed = random.bits();
    const double rz = height * random.between(0.33, 0.4), r = height * random.between(0.26, 0.36);
    static constexpr dvec3 kLeaves[] = {{0.10, 0.22, 0.035}, {0.14, 0.27, 0.05}, {0.075, 0.17, 0.04},
                                        {0.18, 0.26, 0.05},  {0.12, 0.24, 0.07}, {0.30, 0.24, 0.05}};
    const uint32_t pick = random.below(24);
    const dvec3 leaves = kLeaves[pick == 0 ? 5 : pick % 5] * random.between(0.85, 1.2);
    const dvec3 center{x, y, height - rz};
    const double turn = random.between(0, 2 * kPi);
    for (int i = 0; i < lobes; ++i) {
        // one lobe on top, the others round it
        const double a = turn + 2 * kPi * i / std::max(1, lobes - 1), out = i == 0 ? 0 : 0.5 * r;
        const double size = lobes == 1 ? 1 : i == 0 ? 0.74 : random.between(0.52, 0.66);
        const dvec3 shift{out * std::cos(a), out * std::sin(a),
                          lobes == 1 ? 0
                          : i == 0   ? 0.24 * rz
                                     : random.between(-0.4, 0.0) * rz};
        Surface& crown = tile.add(
            makeEllipsoid(center + shift, dvec3{r, r, rz} * size, Material::Foliage, leaves, seed + 3 * uint64_t(i)));
        crown.bumps = 0.18;
        crown.ragged = 0.8;
        crown.thickness = 0.6;
        crown.density = 1.2;
        crown.param[0] = center.z - rz;
        crown.param[1] = height;
    }
    const double trunk = std::max(0.12, height * 0.025);
    const double trunk_top = center.z - rz * 0.5;
    tile.add(makeEllipsoid({x, y, trunk_top * 0.45}, {trunk, trunk, trunk_top * 0.6}, Material::Bark,
                           {0.16, 0.11, 0.075}, seed + 1));
    tile.blobs.push_back({center, {r, r, rz}});
}

void addCar(SceneTile& tile, double x, double y, double angle, HashRandom& random)
{
    static constexpr dvec3 kPaints[] = {{0.75, 0.75, 0.74}, {0.03, 0.03, 0.035}, {0.35, 0.36, 0.38},
                                        {0.45, 0.03, 0.03}, {0.04, 0.09, 0.30},  {0.14, 0.15, 0.17},
                                        {0.6, 0.6, 0.58},   {0.55, 0.35, 0.05}};
    const uint64_t seed = random.bits();
    const dvec3 paint = kPaints[random.below(8)];
    const double length = random.between(4.0, 4.7);
    addTurnedBox(tile, {x, y, 0.58}, {0.5 * length, 0.9, 0.33}, angle, 0.08, Material::CarPaint, paint,
                 Material::CarPaint, paint, seed, 2.5);
    const double back = random.between(-0.35, -0.15);
    addTurnedBox(tile, {x + std::cos(angle) * back, y + std::sin(angle) * back, 1.18}, {0.31 * length, 0.78, 0.27},
                 angle, 0.42, Material::CarGlass, {0.03, 0.035, 0.04}, Material::CarPaint, paint, seed + 1, 2.5);
    const double reach_x = std::abs(std::cos(angle)) * 0.5 * length + std::abs(std::sin(angle)) * 0.9;
    const double reach_y = std::abs(std::sin(angle)) * 0.5 * length + std::abs(std::cos(angle)) * 0.9;
    tile.boxes.push_back({{x - reach_x, y - reach_y, 0.1}, {x + reach_x, y + reach_y, 1.3}});
}

void addSurroundings(const SceneSpec& spec, uint32_t part, SceneTile& tile)
{
    const double e = spec.half_extent;
    if (part == 4) {
        Surface& sky =
            tile.add(makeEllipsoid({0, 0, 0}, dvec3(spec.horizon), Material::Sky, {}, hashKey(spec.seed, 77)));
        sky.share = AnchorShare::Sky;
        // a little below the horizon, hidden by the edge of the land
        sky.polar[1] = 0.5 * kPi + 0.12;
        sky.inward = true;
        sky.all_levels = false;
        sky.thickness = 0.05;
        return;
    }
    // rings whose cells grow with the distance, so that all look alike from the city
    constexpr double kGrowth = 1.3;
    const double end = spec.horizon * 0.94;
    uint64_t ring = 0;
    for (double r0 = e; r0 < end; r0 *= kGrowth, ++ring) {
        const double r1 = std::min(end, r0 * kGrowth);
        const double ca[4] = {1, 0, -1, 0}, sa[4] = {0, 1, 0, -1};
        const auto turn = [&](double x, double y) {
            return dvec3{ca[part] * x - sa[part] * y, sa[part] * x + ca[part] * y, 0};
        };
        // note: the longer edge lies outside; this order of corners makes the normal point up
        Surface& land = tile.add(makeQuad({turn(r1, -r1), turn(r1, r1), turn(r0, r0), turn(r0, -r0)}, Material::Terrain,
                                          {}, hashKey(spec.seed, 78)));
        land.share = AnchorShare::Terrain;
        land.flush = true;
        land.all_levels = false;
        land.thickness = 0.2;
        land.density = (e * e) / (r0 * r0);
        land.reference = {0, 0, 0};
        land.param[0] = e;
        land.param[1] = spec.horizon;
        land.param[2] = spec.scene == SampleScene::City ? cityRiverY(spec) : 1e9;
    }
}

} // namespace gsc
