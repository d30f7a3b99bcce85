// SPDX-License-Identifier: Apache-2.0
// A living room with daylight from one window.
#include "convert/sample/scenes/lighting.h"
#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

constexpr double kX = kRoomHalf.x, kY = kRoomHalf.y, kZ = kRoomHeight;
constexpr dvec3 kOak{0.36, 0.22, 0.11}, kWalnut{0.17, 0.09, 0.05}, kPaint{0.70, 0.67, 0.60}, kSofa{0.10, 0.17, 0.19};

void quad(SceneTile& tile, dvec3 a, dvec3 b, dvec3 c, dvec3 d, Material material, dvec3 color, uint64_t seed,
          double density = 1)
{
    tile.add(makeFlush({a, b, c, d}, material, color, seed)).density = density;
}

void box(SceneTile& tile, dvec3 min, dvec3 max, Material material, dvec3 color, uint64_t seed, double density = 1.2)
{
    addBox(tile, {min, max}, material, color, seed, density);
    tile.boxes.push_back({min, max});
}

void body(SceneTile& tile, dvec3 center, dvec3 radii, Material material, dvec3 color, uint64_t seed,
          double density = 1.5)
{
    tile.add(makeEllipsoid(center, radii, material, color, seed)).density = density;
}

void shell(SceneTile& t)
{
    const RoomWindow& w = kRoomWindow;
    t.add(makeFlush(rectangle(-kX, -kY, kX, kY, 0), Material::Parquet, kOak, 1));
    quad(t, {-kX, kY, kZ}, {kX, kY, kZ}, {kX, -kY, kZ}, {-kX, -kY, kZ}, Material::RoomWall, {0.80, 0.79, 0.76}, 2, 0.5);
    quad(t, {-kX, kY, 0}, {kX, kY, 0}, {kX, kY, kZ}, {-kX, kY, kZ}, Material::RoomWall, {0.42, 0.50, 0.47}, 3, 0.8);
    quad(t, {kX, -kY, 0}, {-kX, -kY, 0}, {-kX, -kY, kZ}, {kX, -kY, kZ}, Material::RoomWall, kPaint, 4, 0.8);
    quad(t, {-kX, -kY, 0}, {-kX, kY, 0}, {-kX, kY, kZ}, {-kX, -kY, kZ}, Material::RoomWall, kPaint, 5, 0.8);
    // the wall with the window, in four parts round it
    const auto part = [&](double y0, double y1, double z0, double z1, uint64_t seed) {
        quad(t, {w.x, y1, z0}, {w.x, y0, z0}, {w.x, y0, z1}, {w.x, y1, z1}, Material::RoomWall, kPaint, seed, 0.8);
        t.surfaces.back().reference = {w.x, kY, 0};
        t.surfaces.back().texture_size[1] = kZ;
    };
    part(-kY, kY, 0, w.z0, 6);
    part(-kY, kY, w.z1, kZ, 7);
    part(-kY, w.y0, w.z0, w.z1, 8);
    part(w.y1, kY, w.z0, w.z1, 9);
    constexpr double kReveal = 0.18;
    const dvec3 white{0.78, 0.77, 0.74};
    quad(t, {w.x, w.y0, w.z0}, {w.x + kReveal, w.y0, w.z0}, {w.x + kReveal, w.y1, w.z0}, {w.x, w.y1, w.z0},
         Material::Plain, white, 10);
    quad(t, {w.x, w.y1, w.z1}, {w.x + kReveal, w.y1, w.z1}, {w.x + kReveal, w.y0, w.z1}, {w.x, w.y0, w.z1},
         Material::Plain, white, 11);
    quad(t, {w.x + kReveal, w.y0, w.z0}, {w.x, w.y0, w.z0}, {w.x, w.y0, w.z1}, {w.x + kReveal, w.y0, w.z1},
         Material::Plain, white, 12);
    quad(t, {w.x, w.y1, w.z0}, {w.x + kReveal, w.y1, w.z0}, {w.x + kReveal, w.y1, w.z1}, {w.x, w.y1, w.z1},
         Material::Plain, white, 13);
    quad(t, {w.x + kReveal, w.y1, w.z0}, {w.x + kReveal, w.y0, w.z0}, {w.x + kReveal, w.y0, w.z1},
         {w.x + kReveal, w.y1, w.z1}, Material::WindowView, {}, 14);
    // a curtain on either side of the window
    for (const double y : {w.y0 - 0.22, w.y1 + 0.22})
        quad(t, {w.x - 0.12, y + 0.28, 0.05}, {w.x - 0.12, y - 0.28, 0.05}, {w.x - 0.12, y - 0.28, 2.5},
             {w.x - 0.12, y + 0.28, 2.5}, Material::Fabric, {0.55, 0.30, 0.16}, 15, 1.2);
}

// Adds a framed picture to a wall. `corner`: lower left corner as seen from the room; `along`: direction to the right.
void picture(SceneTile& t, dvec3 corner, dvec3 along, double width, double height, uint64_t seed)
{
    constexpr double kBar = 0.05, kDeep = 0.03;
    const dvec3 up{0, 0, 1}, out = cross(along, up);
    const auto bar = [&](double u0, double u1, double v0, double v1, uint64_t part) {
        const dvec3 a = corner + along * u0 + up * v0, b = corner + along * u1 + up * v1 + out * kDeep;
        box(t, glm::min(a, b), glm::max(a, b), Material::Wood, kWalnut, seed + part, 1.5);
    };
    bar(0, width, 0, kBar, 0);
    bar(0, width, height - kBar, height, 1);
    bar(0, kBar, kBar, height - kBar, 2);
    bar(width - kBar, width, kBar, height - kBar, 3);
    const dvec3 a = corner + along * kBar + up * kBar + out * 0.02;
    const dvec3 right = along * (width - 2 * kBar), top = up * (height - 2 * kBar);
    quad(t, a, a + right, a + right + top, a + top, Material::Painting, {}, seed + 4, 2.2);
}

void sofaCorner(SceneTile& t)
{
    const double back = kY - 0.06;
    box(t, {-1.35, back - 0.85, 0.12}, {1.05, back, 0.42}, Material::Fabric, kSofa, 20);
    box(t, {-1.35, back - 0.25, 0.42}, {1.05, back, 0.86}, Material::Fabric, kSofa, 21);
    box(t, {-1.55, back - 0.85, 0.1}, {-1.35, back, 0.62}, Material::Fabric, kSofa * 1.1, 22);
    box(t, {1.05, back - 0.85, 0.1}, {1.25, back, 0.62}, Material::Fabric, kSofa * 1.1, 23);
    for (int i = 0; i < 3; ++i)
        body(t, {-0.95 + 0.8 * i, back - 0.52, 0.45}, {0.40, 0.34, 0.11}, Material::Fabric, kSofa * 1.25,
             24 + uint64_t(i));
    const dvec3 pillows[] = {{0.60, 0.36, 0.05}, {0.62, 0.55, 0.44}, {0.48, 0.12, 0.07}};
    for (int i = 0; i < 3; ++i)
        body(t, {-1.05 + 0.95 * i, back - 0.34, 0.66}, {0.23, 0.11, 0.21}, Material::Fabric, pillows[i],
             30 + uint64_t(i), 2);
    // pictures above the sofa
    const double z0 = 1.25;
    picture(t, {-1.25, kY, z0}, {1, 0, 0}, 0.62, 0.82, 40);
    picture(t, {-0.45, kY, z0}, {1, 0, 0}, 0.95, 0.82, 50);
    picture(t, {0.68, kY, z0}, {1, 0, 0}, 0.62, 0.82, 60);
    // a lamp in the corner
    body(t, {-2.45, 1.95, 0.02}, {0.16, 0.16, 0.03}, Material::Plain, {0.05, 0.05, 0.05}, 50);
    box(t, {-2.465, 1.935, 0.02}, {-2.435, 1.965, 1.5}, Material::Plain, {0.05, 0.05, 0.05}, 51, 2);
    body(t, {-2.45, 1.95, 1.62}, {0.24, 0.24, 0.2}, Material::Glow, {1.25, 0.95, 0.60}, 52, 2);
}

void tableAndRug(SceneTile& t)
{
    t.add(makeFlush(rectangle(-1.75, -0.55, 1.35, 1.35, 0.012), Material::Rug, {0.45, 0.16, 0.11}, 60)).density = 1.6;
    const dvec3 low{-0.75, -0.05, 0.36}, high{0.45, 0.60, 0.40};
    box(t, low, high, Material::Wood, kOak, 61, 2);
    for (int i = 0; i < 4; ++i) {
        const double x = i % 2 ? high.x - 0.09 : low.x + 0.03, y = i / 2 ? high.y - 0.09 : low.y + 0.03;
        box(t, {x, y, 0}, {x + 0.06, y + 0.06, 0.36}, Material::Wood, kOak, 62 + uint64_t(i), 2);
    }
    // a bowl of fruit and some books
    body(t, {-0.4, 0.28, 0.44}, {0.17, 0.17, 0.055}, Material::CarPaint, {0.55, 0.56, 0.58}, 70, 3);
    const dvec3 fruit[] = {
        {0.62, 0.10, 0.05}, {0.70, 0.42, 0.05}, {0.35, 0.48, 0.08}, {0.66, 0.25, 0.04}, {0.6, 0.12, 0.06}};
    for (int i = 0; i < 5; ++i)
        body(t, {-0.4 + 0.075 * std::cos(i * 1.256), 0.28 + 0.075 * std::sin(i * 1.256), 0.50}, {0.048, 0.048, 0.046},
             Material::Plain, fruit[i], 71 + uint64_t(i), 4);
    const dvec3 covers[] = {{0.10, 0.20, 0.34}, {0.60, 0.54, 0.42}, {0.45, 0.10, 0.08}};
    for (int i = 0; i < 3; ++i)
        addTurnedBox(t, {0.15, 0.25, 0.415 + 0.03 * i}, {0.13 - 0.01 * i, 0.095, 0.015}, 0.3 * i - 0.2, 0,
                     Material::Plain, covers[i], Material::Plain, covers[i] * 1.1, 80 + uint64_t(i), 3);
}

void shelves(SceneTile& t)
{
    // a bookshelf beside the sofa
    const double x0 = 1.62, x1 = 2.72, y1 = kY, y0 = kY - 0.32, top = 2.1;
    box(t, {x0, y0, 0}, {x0 + 0.03, y1, top}, Material::Wood, kWalnut, 100, 1.5);
    box(t, {x1 - 0.03, y0, 0}, {x1, y1, top}, Material::Wood, kWalnut, 101, 1.5);
    for (int i = 0; i <= 5; ++i) {
        const double z = i * (top - 0.03) / 5;
        box(t, {x0, y0, z}, {x1, y1, z + 0.03}, Material::Wood, kWalnut, 102 + uint64_t(i), 1.5);
        if (i < 5)
            quad(t, {x0 + 0.03, y0 + 0.06, z + 0.03}, {x1 - 0.03, y0 + 0.06, z + 0.03},
                 {x1 - 0.03, y0 + 0.06, z + 0.38}, {x0 + 0.03, y0 + 0.06, z + 0.38}, Material::Books, {},
                 110 + uint64_t(i), 2.5);
    }
    // on the opposite wall a sideboard, a picture and a door
    box(t, {-1.2, -kY, 0.12}, {0.9, -kY + 0.45, 0.72}, Material::Wood, kOak, 120, 1.5);
    picture(t, {0.45, -kY, 1.2}, {-1, 0, 0}, 1.2, 0.75, 200);
    body(t, {-0.85, -kY + 0.22, 0.93}, {0.10, 0.10, 0.21}, Material::CarPaint, {0.08, 0.20, 0.30}, 123, 3);
    body(t, {0.55, -kY + 0.22, 0.82}, {0.13, 0.09, 0.10}, Material::CarPaint, {0.55, 0.34, 0.12}, 124, 3);
    // the door has no back: coarse levels of a thin body's back would lie in front of it
    const dvec3 white{0.72, 0.70, 0.66};
    const double door_x = -kX + 0.05, top_z = 2.05;
    quad(t, {door_x, -1.9, 0}, {door_x, -0.95, 0}, {door_x, -0.95, top_z}, {door_x, -1.9, top_z}, Material::Plain,
         white, 125, 0.8);
    quad(t, {door_x, -0.95, 0}, {-kX, -0.95, 0}, {-kX, -0.95, top_z}, {door_x, -0.95, top_z}, Material::Plain, white,
         127);
    quad(t, {-kX, -1.9, 0}, {door_x, -1.9, 0}, {door_x, -1.9, top_z}, {-kX, -1.9, top_z}, Material::Plain, white, 128);
    t.boxes.push_back({{-kX, -1.9, 0}, {door_x, -0.95, top_z}});
    body(t, {-kX + 0.09, -1.05, 1.0}, {0.03, 0.03, 0.03}, Material::CarPaint, {0.6, 0.5, 0.2}, 126, 6);
}

void chairAndPlant(SceneTile& t)
{
    const dvec3 leather{0.30, 0.13, 0.06};
    addTurnedBox(t, {2.05, -1.55, 0.28}, {0.38, 0.38, 0.13}, 0.7, 0, Material::Fabric, leather, Material::Fabric,
                 leather, 140, 1.4);
    const double a = 0.7;
    addTurnedBox(t, {2.05 + 0.3 * std::sin(a), -1.55 - 0.3 * std::cos(a), 0.62}, {0.38, 0.09, 0.30}, a, 0,
                 Material::Fabric, leather * 1.1, Material::Fabric, leather * 1.1, 141, 1.4);
    body(t, {2.05, -1.55, 0.42}, {0.32, 0.30, 0.08}, Material::Fabric, leather * 1.3, 142);
    t.boxes.push_back({{1.7, -1.95, 0.12}, {2.4, -1.2, 0.42}});
    // a plant in a pot by the window
    const dvec3 at{2.5, 1.55, 0};
    body(t, {at.x, at.y, 0.22}, {0.2, 0.2, 0.24}, Material::Plain, {0.55, 0.50, 0.43}, 150, 2);
    for (int i = 0; i < 9; ++i) {
        const double turn = i * 2.4, lean = 0.10 + 0.028 * i;
        const dvec3 c{at.x + lean * std::cos(turn), at.y + lean * std::sin(turn), 0.72 + 0.07 * ((i * 5) % 9)};
        Surface& leaf =
            t.add(makeEllipsoid(c, {0.14, 0.14, 0.11}, Material::Foliage, {0.09, 0.24, 0.05}, 151 + uint64_t(i)));
        leaf.bumps = 0.35;
        leaf.ragged = 0.7;
        leaf.thickness = 0.4;
        leaf.density = 1.6;
        leaf.param[0] = 0.3;
        leaf.param[1] = 1.4;
    }
    body(t, {at.x, at.y, 0.55}, {0.02, 0.02, 0.4}, Material::Bark, {0.15, 0.12, 0.06}, 170, 2);
    t.boxes.push_back({{at.x - 0.1, at.y - 0.1, 0.05}, {at.x + 0.1, at.y + 0.1, 0.38}});
}

// Cuts a parallelogram into pieces with sides of at most `largest` metres.
void splitSurface(const Surface& s, double largest, std::vector<Surface>& out)
{
    const auto pieces = [&](dvec3 side) {
        return s.shape == Surface::Shape::Quad ? std::max(1, int(std::ceil(length(side) / largest))) : 1;
    };
    const int nu = pieces(s.corner[1] - s.corner[0]), nv = pieces(s.corner[3] - s.corner[0]);
    for (int j = 0; j < nv; ++j)
        for (int i = 0; i < nu; ++i) {
            Surface& piece = out.emplace_back(s);
            if (nu * nv == 1)
                continue;
            const auto at = [&](int u, int v) { return surfacePoint(s, double(u) / nu, double(v) / nv).position; };
            piece.corner = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
            piece.flush = true;
        }
}

} // namespace

void planRoom(uint64_t anchors, SceneSpec& spec)
{
    spec.side = uint32_t(std::clamp(std::ceil(std::sqrt(double(anchors) / 40'000)), 1.0, 40.0));
    spec.half_extent = kX + 0.5;
    spec.main_tiles = spec.tile_count = spec.side * spec.side;
}

void buildRoomTile(const SceneSpec& spec, uint32_t index, SceneTile& tile)
{
    SceneTile room;
    shell(room);
    sofaCorner(room);
    tableAndRug(room);
    shelves(room);
    chairAndPlant(room);
    tile.boxes = std::move(room.boxes);

    const double size = 2 * spec.half_extent / spec.side;
    tile.bounded = true;
    const uint32_t at[2] = {index % spec.side, index / spec.side};
    for (int axis = 0; axis < 2; ++axis) {
        tile.min[axis] = at[axis] * size - spec.half_extent;
        tile.max[axis] = tile.min[axis] + size;
    }
    std::vector<Surface> pieces;
    for (Surface& s : room.surfaces) {
        s.seed = hashKey(spec.seed, s.seed, 4);
        splitSurface(s, spec.side > 1 ? size : 1e9, pieces);
    }
    for (const Surface& s : pieces) {
        const dvec3 c = s.shape == Surface::Shape::Quad ? surfacePoint(s, 0.5, 0.5).position : s.center;
        if (c.x >= tile.min[0] && c.x < tile.max[0] && c.y >= tile.min[1] && c.y < tile.max[1])
            tile.surfaces.push_back(s);
    }
}

std::vector<SourceCamera> roomCameras(const SceneSpec&)
{
    std::vector<SourceCamera> cameras;
    for (int i = 0; i < 48; ++i) {
        const double a = 2 * kPi * i / 48 - 0.79 * kPi;
        const dvec3 from{2.35 * std::cos(a), 1.75 * std::sin(a), 1.5 + 0.15 * std::sin(3 * a)};
        const dvec3 to{-1.2 * std::cos(a) + 0.2, -1.2 * std::sin(a) + 0.35, 0.85};
        cameras.push_back(photograph(from, to, 78));
    }
    return cameras;
}

} // namespace gsc
