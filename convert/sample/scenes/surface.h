// SPDX-License-Identifier: Apache-2.0
// A scene is a list of surface patches; each is cut into near-square cells, one anchor per cell.
#pragma once

#include "convert/survey/vec3.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gsc {

enum class Material : uint8_t {
    CityGround, // reference = centre of the tile, param[0] = LotKind
    StreetGround,
    Facade, // accent = trim, param = bay width, floor height, window share x and y, style, shop front
    FlatRoof,
    TileRoof,
    Plain,
    Bark,
    Foliage, // param[0] = bottom, param[1] = top of the crown
    Water,
    Terrain, // param = half extent of the city, horizon radius, river y or 1e9
    Sky,
    CarPaint,
    CarGlass,
    Glow, // emits `color` whatever the light
    Parquet,
    Rug,
    RoomWall,
    Books,
    Painting,
    WindowView,
    Wood,
    Fabric,
};

enum class AnchorShare : uint8_t { Main, Sky, Terrain, Count };

using Corners = std::array<dvec3, 4>;

struct Surface {
    enum class Shape : uint8_t {
        Quad,      // corner A B C D counter-clockwise seen from outside; A->B is u, A->D is v
        Ellipsoid, // u = azimuth, v = polar angle between polar[0] and polar[1] (0 = +z)
        Disc,      // horizontal, facing up; u = azimuth, v = radius
    };
    Shape shape = Shape::Quad;
    Material material = Material::Plain;
    AnchorShare share = AnchorShare::Main;
    Corners corner{};
    dvec3 center{}, radii{};
    double polar[2] = {0, kPi};
    bool inward = false; // an ellipsoid seen from inside

    dvec3 color{}, accent{}; // linear reflectance
    double param[6] = {};
    dvec3 reference{};           // origin of texture coordinates; quads: point A as first built
    double texture_size[2] = {}; // metres along u and v as first built
    uint64_t seed = 0;
    double density = 1;      // anchors per area, relative to the rest of its share
    double thickness = 0.15; // sigma along the normal, relative to that in the plane
    double ragged = 0;       // 0..1 spread of orientation, size and opacity of the Gaussians of an anchor
    double bumps = 0;        // relative displacement of an ellipsoid's radius
    bool flush = false;      // joins its neighbours: coarse levels must not shrink it
    bool all_levels = true;  // false: level 0 only
};

struct SurfacePoint {
    dvec3 position{}, normal{}, tangent_u{}, tangent_v{}; // orthonormal, right-handed
    double s = 0, t = 0;                                  // metres along u and v from the reference
};

// An axis-aligned rectangle, seen from above.
Corners rectangle(double x0, double y0, double x1, double y1, double z);

Surface makeQuad(const Corners& corners, Material material, dvec3 color, uint64_t seed);
// A quad that joins its neighbours.
Surface makeFlush(const Corners& corners, Material material, dvec3 color, uint64_t seed);
Surface makeEllipsoid(dvec3 center, dvec3 radii, Material material, dvec3 color, uint64_t seed);

double surfaceArea(const Surface& surface);
SurfacePoint surfacePoint(const Surface& surface, double u, double v);
// The surface as a coarser level sees it: moved `inset` into the solid, so that finer levels cover it from every
// direction, and kept clear of its silhouette by as much.
Surface sunkSurface(const Surface& surface, double inset);

// Rows of cells: `count` cells cover the surface exactly, sizes differ by at most one cell per row.
struct CellLayout {
    uint64_t count = 0;
    double row_height = 0;           // metres
    std::vector<uint64_t> row_first; // rows + 1
};

struct Cell {
    double u0, u1, v0, v1;
    double width, height; // metres
};

CellLayout layoutCells(const Surface& surface, uint64_t count);
// `row` is a cursor: pass 0 first, then the value that the last call left. Indices must not decrease.
Cell cellAt(const Surface& surface, const CellLayout& layout, uint64_t index, size_t& row);

} // namespace gsc
