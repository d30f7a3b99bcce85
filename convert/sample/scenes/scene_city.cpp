// SPDX-License-Identifier: Apache-2.0
// A city of square blocks round a high centre, with a river, parks and suburbs, in open country.
#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

constexpr double kHalf = 0.5 * kBlockPitch;
constexpr double kLot = 22.5;     // metres, half of the width of the building area of a block
constexpr double kTreeRow = 24.6; // metres from the centre of a block to its street trees
constexpr double kLane = 27.9;    // metres from the centre of a block to the middle of a driving lane
constexpr double kRiverHalf = 16;
constexpr double kBridge = 25.5; // metres from the centre of a block to the start of the bridge

struct Rect {
    double x0, y0, x1, y1;
};

struct Block {
    const SceneSpec& spec;
    double cx, cy;
    double radius; // distance of the block from the centre of the city: 0 in the centre, about 1 at the edge
    HashRandom random;
    SceneTile& tile;
    LotKind lot = LotKind::Grass;
    // ground under buildings, which needs no anchors; metres from the centre of the block
    std::vector<Rect> covered = {};
};

int riverRow(const SceneSpec& spec)
{
    return spec.side >= 4 ? int(spec.side) / 3 : -1;
}

void building(Block& b, double x0, double y0, double x1, double y1, double height)
{
    addBuilding(b.tile, b.cx + x0, b.cy + y0, b.cx + x1, b.cy + y1, height, randomStyle(b.random, height), b.random);
    b.covered.push_back({x0, y0, x1, y1});
}

bool blocked(const Block& b, double x, double y, double margin)
{
    for (const Rect& r : b.covered)
        if (x > r.x0 - margin && x < r.x1 + margin && y > r.y0 - margin && y < r.y1 + margin)
            return true;
    return false;
}

void tree(Block& b, double x, double y, double low, double high)
{
    addTree(b.tile, b.cx + x, b.cy + y, b.random.between(low, high), 1, b.random);
}

void scatterTrees(Block& b, int count, double half, double margin, double low, double high)
{
    for (int i = 0; i < count; ++i) {
        const double x = b.random.between(-half, half), y = b.random.between(-half, half);
        if (!blocked(b, x, y, margin))
            tree(b, x, y, low, high);
    }
}

void towerBlock(Block& b)
{
    b.lot = LotKind::Paved;
    const double height = lerp(105, 45, std::min(1.0, b.radius * 2.2)) * b.random.between(0.75, 1.15);
    if (b.random.chance(0.5)) {
        const double half = b.random.between(10, 13), ox = b.random.between(-6, 6), oy = b.random.between(-6, 6);
        building(b, ox - half, oy - half, ox + half, oy + half, height);
        if (b.random.chance(0.6)) { // a smaller storey on top
            BuildingStyle style = randomStyle(b.random, height);
            style.shops = false;
            const double in = half * 0.62;
            const double base = height - 1, top = height * b.random.between(1.12, 1.3);
            const Corners p = rectangle(b.cx + ox - in, b.cy + oy - in, b.cx + ox + in, b.cy + oy + in, base);
            for (size_t i = 0; i < 4; ++i)
                addFacade(b.tile, p[i], p[(i + 1) % 4], top - base, style, b.random.bits());
            b.tile.add(makeQuad(rectangle(p[0].x, p[0].y, p[2].x, p[2].y, top - 0.8), Material::FlatRoof,
                                {0.4, 0.4, 0.39}, b.random.bits()));
            b.tile.boxes.push_back({p[0], {p[2].x, p[2].y, top}});
        }
    } else {
        building(b, -21, -20, -3, 20, height * b.random.between(0.5, 0.9));
        building(b, 6, -20, 21, -1, height);
        building(b, 7, 8, 21, 20, b.random.between(14, 24));
    }
    scatterTrees(b, 12, 21, 2.6, 5, 8);
}

// Houses in a closed ring round a green court.
void perimeterBlock(Block& b)
{
    b.lot = LotKind::Court;
    const double base = lerp(24, 12, std::min(1.0, b.radius));
    const auto height = [&] { return base * b.random.between(0.75, 1.25); };
    constexpr double kDeep = 10.5; // half of the width of the court in metres
    for (const double side : {-1.0, 1.0}) {
        const double low = side < 0 ? -kLot : kDeep, high = side < 0 ? -kDeep : kLot;
        double x = -kLot;
        while (x < kLot - 1) {
            double end = x + b.random.between(12, 20);
            if (kLot - end < 9)
                end = kLot;
            building(b, x, low, end, high, height());
            x = end;
        }
        if (b.random.chance(0.8))
            building(b, low, -kDeep, high, kDeep, height());
    }
    scatterTrees(b, 9, 9.5, 1.8, 5, 9);
}

void suburbBlock(Block& b)
{
    b.lot = LotKind::Grass;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 2; ++j) {
            if (b.random.chance(0.08))
                continue;
            const double x = -15 + 15 * i + b.random.between(-1, 1), y = j == 0 ? -13.0 : 13.0;
            const double hx = b.random.between(4, 5.2), hy = b.random.between(4.2, 5.6);
            addHouse(b.tile, b.cx + x - hx, b.cy + y - hy, b.cx + x + hx, b.cy + y + hy,
                     b.random.chance(0.5) ? 5.6 : 3.4, b.random.chance(0.5), b.random);
            b.covered.push_back({x - hx, y - hy, x + hx, y + hy});
        }
    scatterTrees(b, 14, 21.5, 2.5, 4, 8.5);
}

void parkBlock(Block& b)
{
    b.lot = LotKind::Park;
    Surface& pond = b.tile.add({});
    pond.shape = Surface::Shape::Disc;
    pond.material = Material::Water;
    pond.center = {b.cx + b.random.between(-5, 5), b.cy + b.random.between(-5, 5), 0.12};
    pond.radii = {b.random.between(7, 10), b.random.between(6, 8), 1};
    pond.color = {0.05, 0.10, 0.11};
    pond.flush = true;
    pond.reference = pond.center;
    pond.seed = b.random.bits();
    const dvec3 middle = pond.center, reach = pond.radii + 2.5;
    for (int i = 0; i < 34; ++i) {
        const double x = b.random.between(-22, 22), y = b.random.between(-22, 22);
        const double dx = (b.cx + x - middle.x) / reach.x, dy = (b.cy + y - middle.y) / reach.y;
        if (dx * dx + dy * dy > 1 && std::abs(std::abs(x) - std::abs(y)) > 3.5)
            tree(b, x, y, 6, 12);
    }
}

void riverBlock(Block& b)
{
    b.lot = LotKind::Grass;
    constexpr double kDepth = 2.5, kRail = 1.0;
    const double x0 = b.cx - kHalf, x1 = b.cx + kHalf;
    const double y0 = b.cy - kRiverHalf, y1 = b.cy + kRiverHalf;
    b.tile
        .add(makeFlush(rectangle(x0, y0, x1, y1, -kDepth), Material::Water, {0.045, 0.10, 0.12},
                       hashKey(b.spec.seed, 31)))
        .reference = {};
    const dvec3 stone{0.40, 0.37, 0.32};
    const auto wall = [&](dvec3 a, dvec3 c, double low, double high, uint64_t part) {
        a.z = c.z = low;
        const dvec3 up{0, 0, high - low};
        b.tile.add(makeFlush({a, c, c + up, a + up}, Material::Plain, stone, hashKey(b.spec.seed, 40 + part)));
    };
    // embankments towards the water; the bridge has a wall on either side
    wall({x1, y0, 0}, {x0, y0, 0}, -kDepth, kRail, 0);
    wall({x0, y1, 0}, {x1, y1, 0}, -kDepth, kRail, 1);
    wall({b.cx + kBridge, y1, 0}, {b.cx + kBridge, y0, 0}, -1.4, kRail, 2);
    wall({b.cx - kBridge, y0, 0}, {b.cx - kBridge, y1, 0}, -1.4, kRail, 3);
    b.tile.boxes.push_back({{b.cx + kBridge, y0, -1.2}, {x1, y1, 0}});
    b.tile.boxes.push_back({{x0, y0, -1.2}, {b.cx - kBridge, y1, 0}});
    b.covered.push_back({-kBridge, -kRiverHalf, kBridge, kRiverHalf});
    for (const double y : {-19.5, 19.5})
        for (double x = -21; x < 22; x += 7)
            tree(b, x + b.random.between(-1, 1), y, 6, 9);
}

// Adds the ground of a block that no building covers, cut into rectangles along the edges of the buildings.
void addGround(Block& b)
{
    std::vector<double> xs = {-kHalf, kHalf}, ys = {-kHalf, kHalf};
    for (const Rect& r : b.covered) {
        xs.insert(xs.end(), {r.x0, r.x1});
        ys.insert(ys.end(), {r.y0, r.y1});
    }
    for (std::vector<double>* v : {&xs, &ys}) {
        std::sort(v->begin(), v->end());
        v->erase(std::unique(v->begin(), v->end()), v->end());
    }
    for (size_t j = 0; j + 1 < ys.size(); ++j) {
        const double mid_y = 0.5 * (ys[j] + ys[j + 1]);
        for (size_t i = 0; i + 1 < xs.size();) {
            if (blocked(b, 0.5 * (xs[i] + xs[i + 1]), mid_y, 0)) {
                ++i;
                continue;
            }
            size_t end = i + 1;
            while (end + 1 < xs.size() && !blocked(b, 0.5 * (xs[end] + xs[end + 1]), mid_y, 0))
                ++end;
            Surface& ground =
                b.tile.add(makeFlush(rectangle(b.cx + xs[i], b.cy + ys[j], b.cx + xs[end], b.cy + ys[j + 1], 0),
                                     Material::CityGround, {}, hashKey(b.spec.seed, 3)));
            ground.reference = {b.cx, b.cy, 0};
            ground.param[0] = double(b.lot);
            i = end;
        }
    }
}

void addTraffic(Block& b, bool river)
{
    // a block has the two lanes next to its own edges
    for (int edge = 0; edge < 4; ++edge)
        for (double along = -21; along < 22; along += 7) {
            if (!b.random.chance(0.33))
                continue;
            const double d = along + b.random.between(-2, 2);
            const double out = b.random.chance(0.5) ? kLane - 0.75 : kLane + 0.4;
            if (river && edge < 2 && std::abs(d) < kRiverHalf + 3)
                continue;
            const double sign = edge % 2 == 0 ? 1 : -1;
            if (edge < 2)
                addCar(b.tile, b.cx + sign * out, b.cy + d, sign * 0.5 * kPi, b.random);
            else
                addCar(b.tile, b.cx + d, b.cy + sign * out, sign > 0 ? kPi : 0.0, b.random);
        }
    if (river)
        return;
    const double step = 9.5;
    for (int edge = 0; edge < 4; ++edge)
        for (double along = -19; along < 20; along += step) {
            if (!b.random.chance(b.lot == LotKind::Paved ? 0.5 : 0.7))
                continue;
            const double sign = edge % 2 == 0 ? kTreeRow : -kTreeRow;
            if (edge < 2)
                tree(b, sign, along, 5, 7.5);
            else
                tree(b, along, sign, 5, 7.5);
        }
}

} // namespace

double cityRiverY(const SceneSpec& spec)
{
    return riverRow(spec) < 0 ? 1e9 : (riverRow(spec) + 0.5) * kBlockPitch - spec.half_extent;
}

void planCity(uint64_t anchors, SceneSpec& spec)
{
    // more anchors make the city larger and more detailed
    const double wanted = 5 * std::pow(double(anchors) / 100'000, 0.3);
    spec.side = uint32_t(std::clamp(std::round(wanted), 1.0, 64.0));
    spec.half_extent = 0.5 * kBlockPitch * spec.side;
    spec.horizon = 8 * std::max(spec.half_extent, 120.0);
    spec.main_tiles = spec.side * spec.side;
    spec.tile_count = spec.main_tiles + kSurroundingParts;
    spec.share[size_t(AnchorShare::Sky)] = 0.03;
    spec.share[size_t(AnchorShare::Terrain)] = 0.08;
    spec.share[size_t(AnchorShare::Main)] = 0.89;
}

void buildCityTile(const SceneSpec& spec, uint32_t index, SceneTile& tile)
{
    const int column = int(index % spec.side), row = int(index / spec.side);
    const double cx = (column + 0.5) * kBlockPitch - spec.half_extent;
    const double cy = (row + 0.5) * kBlockPitch - spec.half_extent;
    const double edge = std::max(spec.half_extent, 90.0);
    Block b{spec, cx, cy, std::hypot(cx, cy) / edge, HashRandom(hashKey(spec.seed, index, 1)), tile};
    tile.bounded = true;
    tile.min[0] = cx - kHalf, tile.min[1] = cy - kHalf;
    tile.max[0] = cx + kHalf, tile.max[1] = cy + kHalf;

    const bool river = row == riverRow(spec);
    const int middle = int(spec.side) / 2;
    const double dice = b.random.unit();
    if (river)
        riverBlock(b);
    else if (spec.side > 2 && ((column == middle && row == middle + 1) || dice < 0.07))
        parkBlock(b);
    else if (b.radius < 0.5)
        dice < 0.62 ? towerBlock(b) : perimeterBlock(b);
    else if (b.radius < 0.85 + 0.2 * (dice - 0.5))
        perimeterBlock(b);
    else
        suburbBlock(b);
    addGround(b);
    addTraffic(b, river);
}

std::vector<SourceCamera> cityCameras(const SceneSpec& spec)
{
    std::vector<SourceCamera> cameras;
    // half of the width that an aerial photograph shows, in metres
    const double reach = std::clamp(spec.half_extent, 60.0, 330.0);
    const auto look = [&](dvec3 from, dvec3 to) { cameras.push_back(photograph(from, to, 64)); };
    const double river_y = cityRiverY(spec);
    // photographs in two circles, the second lower and closer
    for (int i = 0; i < 40; ++i) {
        const double a = 2 * kPi * i / 40 - 0.62 * kPi;
        look({1.1 * reach * std::cos(a), 1.1 * reach * std::sin(a), 0.6 * reach}, {0, 0, 0.2 * reach});
    }
    for (int i = 0; i < 24; ++i) {
        const double a = 2 * kPi * i / 24 - 0.6 * kPi;
        look({0.9 * reach * std::cos(a), 0.9 * reach * std::sin(a), 0.36 * reach}, {0, 0, 0.18 * reach});
    }
    // photographs along the river, then down an avenue
    if (river_y < 1e8)
        for (int i = 0; i < 8; ++i) {
            const double x = lerp(-0.95, 0.1, i / 7.0) * reach;
            look({x, river_y, 14}, {x + 100, river_y + 14, 8});
        }
    const double avenue = spec.side % 2 == 0 ? 0 : 0.5 * kBlockPitch;
    for (int i = 0; i < 8; ++i) {
        const double y = lerp(-0.8, 0.2, i / 7.0) * reach;
        look({avenue + 1, y, 6}, {avenue, y + 60, 9});
    }
    return cameras;
}

} // namespace gsc
