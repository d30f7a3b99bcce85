// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/surface.h"

#include "convert/sample/model/hash_random.h"

namespace gsc {

namespace {

constexpr double kTwoPi = 2 * kPi;
constexpr int kAreaRows = 32; // rows of which the area of an ellipsoid is summed

// Length in metres of the row at v, 0 to 1.
double rowWidth(const Surface& s, double v)
{
    switch (s.shape) {
    case Surface::Shape::Quad:
        return lerp(length(s.corner[1] - s.corner[0]), length(s.corner[2] - s.corner[3]), v);
    case Surface::Shape::Ellipsoid:
        return kTwoPi * 0.5 * (s.radii.x + s.radii.y) * std::abs(std::sin(lerp(s.polar[0], s.polar[1], v)));
    case Surface::Shape::Disc:
        return kTwoPi * 0.5 * (s.radii.x + s.radii.y) * v;
    }
    return 0;
}

double columnHeight(const Surface& s)
{
    switch (s.shape) {
    case Surface::Shape::Quad: {
        // distance between the two horizontal edges, also if the sides are slanted
        const dvec3 u = normalized(s.corner[1] - s.corner[0]);
        const dvec3 side = lerp(s.corner[3], s.corner[2], 0.5) - lerp(s.corner[0], s.corner[1], 0.5);
        return length(side - u * dot(side, u));
    }
    case Surface::Shape::Ellipsoid:
        return 0.5 * (0.5 * (s.radii.x + s.radii.y) + s.radii.z) * (s.polar[1] - s.polar[0]);
    case Surface::Shape::Disc:
        return 0.5 * (s.radii.x + s.radii.y);
    }
    return 0;
}

// Displacement of a tree crown's surface, in [-1, 1]: a few waves over the sphere.
double bumpAt(const Surface& s, double azimuth, double polar)
{
    const double phase = kTwoPi * hashUnit(s.seed + 11), other = kTwoPi * hashUnit(s.seed + 12);
    const double sine = std::sin(polar);
    return sine * (0.45 * std::sin(3 * azimuth + phase + 2 * polar) + 0.3 * std::sin(5 * polar + other + 2 * azimuth) +
                   0.25 * std::sin(7 * azimuth - 6 * polar + other));
}

} // namespace

Corners rectangle(double x0, double y0, double x1, double y1, double z)
{
    return {{{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}};
}

Surface makeQuad(const Corners& corners, Material material, dvec3 color, uint64_t seed)
{
    Surface s;
    s.corner = corners;
    s.material = material;
    s.color = color;
    s.accent = color;
    s.seed = seed;
    s.reference = corners[0];
    s.texture_size[0] = length(corners[1] - corners[0]);
    s.texture_size[1] = columnHeight(s);
    return s;
}

Surface makeFlush(const Corners& corners, Material material, dvec3 color, uint64_t seed)
{
    Surface s = makeQuad(corners, material, color, seed);
    s.flush = true;
    return s;
}

Surface makeEllipsoid(dvec3 center, dvec3 radii, Material material, dvec3 color, uint64_t seed)
{
    Surface s;
    s.shape = Surface::Shape::Ellipsoid;
    s.center = center;
    s.radii = radii;
    s.material = material;
    s.color = color;
    s.accent = color;
    s.seed = seed;
    s.reference = center;
    return s;
}

double surfaceArea(const Surface& s)
{
    if (s.shape != Surface::Shape::Ellipsoid)
        return columnHeight(s) * 0.5 * (rowWidth(s, 0) + rowWidth(s, 1));
    double width = 0;
    for (int i = 0; i < kAreaRows; ++i)
        width += rowWidth(s, (i + 0.5) / kAreaRows);
    return width / kAreaRows * columnHeight(s);
}

SurfacePoint surfacePoint(const Surface& s, double u, double v)
{
    SurfacePoint p;
    if (s.shape == Surface::Shape::Quad) {
        p.position = lerp(lerp(s.corner[0], s.corner[1], u), lerp(s.corner[3], s.corner[2], u), v);
        p.tangent_u = normalized(s.corner[1] - s.corner[0]);
        p.normal = normalized(cross(s.corner[1] - s.corner[0],
                                    lerp(s.corner[3], s.corner[2], 0.5) - lerp(s.corner[0], s.corner[1], 0.5)));
        p.tangent_v = cross(p.normal, p.tangent_u);
        p.s = dot(p.position - s.reference, p.tangent_u);
        p.t = dot(p.position - s.reference, p.tangent_v);
        return p;
    }
    // azimuth 0 differs from body to body
    const double azimuth = kTwoPi * (u + hashUnit(s.seed + 5));
    const double ca = std::cos(azimuth), sa = std::sin(azimuth);
    if (s.shape == Surface::Shape::Disc) {
        p.position = s.center + dvec3{s.radii.x * v * ca, s.radii.y * v * sa, 0};
        p.normal = {0, 0, 1};
        p.tangent_u = {1, 0, 0};
        p.tangent_v = {0, 1, 0};
    } else {
        const double polar = lerp(s.polar[0], s.polar[1], v);
        const double cp = std::cos(polar), sp = std::sin(polar);
        const double swell = s.bumps > 0 ? 1 + s.bumps * bumpAt(s, azimuth, polar) : 1;
        p.position = s.center + dvec3{s.radii.x * sp * ca, s.radii.y * sp * sa, s.radii.z * cp} * swell;
        p.normal = normalized({sp * ca / s.radii.x, sp * sa / s.radii.y, cp / s.radii.z});
        if (s.inward)
            p.normal = -p.normal;
        p.tangent_u = {-sa, ca, 0};
        p.tangent_v = normalized(cross(p.normal, p.tangent_u));
        p.tangent_u = cross(p.tangent_v, p.normal);
    }
    p.s = p.position.x - s.reference.x;
    p.t = p.position.y - s.reference.y;
    return p;
}

Surface sunkSurface(const Surface& surface, double inset)
{
    Surface s = surface;
    // largest inset, as a share of half the size of the body, so that something is left of the smallest
    constexpr double kMostShrink = 0.35;
    if (s.shape == Surface::Shape::Quad) {
        const SurfacePoint middle = surfacePoint(s, 0.5, 0.5);
        const double half = 0.5 * std::min(0.5 * (rowWidth(s, 0) + rowWidth(s, 1)), columnHeight(s));
        const double shrink = s.flush || half <= 0 ? 0 : std::min(kMostShrink, inset / half);
        // walls keep their lower edge, because they stand on something
        const bool wall = std::abs(middle.normal.z) < 0.5;
        const dvec3 low = lerp(surface.corner[0], surface.corner[1], 0.5);
        for (size_t i = 0; i < 4; ++i)
            s.corner[i] =
                lerp(surface.corner[i], wall && i < 2 ? low : middle.position, shrink) - middle.normal * inset;
    } else if (s.shape == Surface::Shape::Disc) {
        s.center.z -= inset;
    } else {
        const double smallest = std::min({s.radii.x, s.radii.y, s.radii.z});
        s.radii = s.radii * (1 - std::min(kMostShrink, inset / smallest));
    }
    return s;
}

CellLayout layoutCells(const Surface& surface, uint64_t count)
{
    CellLayout layout;
    layout.count = count;
    const double height = columnHeight(surface);
    const double width = surfaceArea(surface) / height;
    const double wanted = std::sqrt(double(count) * height / width);
    const uint64_t rows = std::clamp<uint64_t>(uint64_t(wanted + 0.5), 1, std::max<uint64_t>(count, 1));
    layout.row_height = height / double(rows);
    layout.row_first.resize(rows + 1, 0);
    double total = 0;
    for (uint64_t j = 0; j < rows; ++j)
        total += rowWidth(surface, (double(j) + 0.5) / double(rows));
    double sum = 0;
    for (uint64_t j = 0; j < rows; ++j) {
        sum += rowWidth(surface, (double(j) + 0.5) / double(rows));
        const auto first = uint64_t(std::floor(double(count) * (sum / total) + 0.5));
        layout.row_first[j + 1] = j + 1 == rows ? count : std::min(first, count);
    }
    return layout;
}

Cell cellAt(const Surface& surface, const CellLayout& layout, uint64_t index, size_t& row)
{
    while (layout.row_first[row + 1] <= index)
        ++row;
    const uint64_t in_row = layout.row_first[row + 1] - layout.row_first[row];
    const uint64_t column = index - layout.row_first[row];
    const double rows = double(layout.row_first.size() - 1);
    Cell cell;
    cell.u0 = double(column) / double(in_row);
    cell.u1 = double(column + 1) / double(in_row);
    cell.v0 = double(row) / rows;
    cell.v1 = double(row + 1) / rows;
    cell.width = rowWidth(surface, 0.5 * (cell.v0 + cell.v1)) / double(in_row);
    cell.height = layout.row_height;
    return cell;
}

} // namespace gsc
