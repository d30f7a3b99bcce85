// SPDX-License-Identifier: Apache-2.0
// A scene is a list of surface patches. Each is cut into nearly square cells, with one anchor per cell.
#pragma once

#include "convert/survey/vec3.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gsc {

enum class Material : uint8_t {
    CityGround, // `reference` = centre of the tile, param[0] = LotKind
    StreetGround,
    // `accent` = colour of the trim; `param` = width of a bay and height of a floor in metres, share of window in x and
    // y, style, shop front
    Facade,
    FlatRoof,
    TileRoof,
    Plain,
    Bark,
    Foliage, // param[0], param[1] = height of the bottom and of the top of the crown
    Water,
    // `param` = half extent of the city, radius of the horizon, y of the river (1e9 = none)
    Terrain,
    Sky,
    CarPaint,
    CarGlass,
    Glow, // shines with `color`, whatever the light
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
        // corners A B C D counter-clockwise as seen from outside; u runs from A to B, v from A to D
        Quad,
        // u = azimuth, v = polar angle between polar[0] and polar[1] (0 = +z)
        Ellipsoid,
        Disc, // horizontal, facing up; u = azimuth, v = radius
    };
    Shape shape = Shape::Quad;
    Material material = Material::Plain;
    AnchorShare share = AnchorShare::Main;
    Corners corner{};
    dvec3 center{}, radii{};
    double polar[2] = {0, kPi};
    bool inward = false; // the ellipsoid is seen from inside

    dvec3 color{}, accent{}; // linear reflectance
    double param[6] = {};
    dvec3 reference{};           // origin of the texture coordinates; point A of a quad before it was sunk
    double texture_size[2] = {}; // metres along u and v before it was sunk
    uint64_t seed = 0;
    double density = 1;      // anchors per area, as a multiple of other surfaces with this AnchorShare
    double thickness = 0.15; // sigma of a Gaussian along the normal, as a multiple of that in the plane
    // 0 to 1: how much the Gaussians of an anchor vary in orientation, size and opacity
    double ragged = 0;
    double bumps = 0;       // displacement of an ellipsoid's surface, as a share of the radius
    bool flush = false;     // joins other surfaces at its edges, so coarse levels must not shrink it
    bool all_levels = true; // false: has anchors on level 0 only
};

struct SurfacePoint {
    dvec3 position{}, normal{}, tangent_u{}, tangent_v{}; // the three vectors are orthonormal and right-handed
    double s = 0, t = 0;                                  // metres along u and v from Surface::reference
};

// Corners of a horizontal rectangle at height z, with its sides along x and y.
Corners rectangle(double x0, double y0, double x1, double y1, double z);

Surface makeQuad(const Corners& corners, Material material, dvec3 color, uint64_t seed);
// A quad that joins other surfaces at its edges (Surface::flush).
Surface makeFlush(const Corners& corners, Material material, dvec3 color, uint64_t seed);
Surface makeEllipsoid(dvec3 center, dvec3 radii, Material material, dvec3 color, uint64_t seed);

double surfaceArea(const Surface& surface);
SurfacePoint surfacePoint(const Surface& surface, double u, double v);
// The surface as a coarser level has it: moved by `inset` metres into the body, so that finer levels cover it from
// every direction, and smaller by as much at its edges.
Surface sunkSurface(const Surface& surface, double inset);

// How a surface is cut into rows of cells: `count` cells cover it exactly, and the numbers of cells in rows are
// rounded.
struct CellLayout {
    uint64_t count = 0;
    double row_height = 0;           // metres between neighbouring rows of grid cells
    std::vector<uint64_t> row_first; // number of the first cell of each row, and of the end
};

struct Cell {
    double u0, u1, v0, v1;
    double width, height; // in metres
};

CellLayout layoutCells(const Surface& surface, uint64_t count);
// Cell number `index`. `row` is a cursor for calls with ascending `index`: pass 0 first, then what the last call left
// in it.
Cell cellAt(const Surface& surface, const CellLayout& layout, uint64_t index, size_t& row);

} // namespace gsc
