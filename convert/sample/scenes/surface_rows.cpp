// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/surface_rows.h"

#include "convert/sample/model/hash_random.h"
#include "convert/sample/scenes/materials.h"

#include <glm/gtc/type_ptr.hpp>

#include <cmath>
#include <cstring>

namespace gsc {

namespace {

constexpr uint32_t K = kSampleOffsets;
// Sigma of a Gaussian, as a multiple of the distance to the next: sharp, for coarse levels, or so wide that nothing
// behind shines through.
constexpr double kSharpSigma = 0.64, kCoarseSigma = 0.7, kClosedSigma = 0.8;
constexpr float kOpacityLogit = -2.1972246f; // logit(0.1), which the trainers store in every anchor
// On the finest level of an octree model, one anchor in so many shares its cell with another, as in trained models.
constexpr uint64_t kDuplicateEvery = 97;
constexpr uint32_t kExtraSteps = 100;
// metres; in smaller cells of a room the light is computed once, because it hardly changes
constexpr double kOneLightCell = 0.05;

double logit(double display)
{
    const double x = std::clamp(display, 0.03, 0.97);
    return std::log(x / (1 - x));
}

// Rotation of the axes into (u, v, n) as (x, y, z) / w of a quaternion. Signs of axes are chosen freely, because an
// ellipsoid looks the same, so that w >= 1/2 and the result stays below sqrt(3).
dvec3 turnOf(dvec3 u, dvec3 v, dvec3 n)
{
    dvec3 best{};
    double best_trace = -2;
    const double signs[4][3] = {{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
    for (const auto& s : signs) {
        const dvec3 a = u * s[0], b = v * s[1], c = n * s[2];
        const double trace = a.x + b.y + c.z;
        if (trace > best_trace) {
            best_trace = trace;
            best = dvec3{b.z - c.y, c.x - a.z, a.y - b.x} * (1 / (1 + trace));
        }
    }
    return best;
}

// How much a surface mirrors towards each axis; 0 unless it faces along that axis.
dvec3 glossAxes(dvec3 normal, double gloss)
{
    const auto part = [&](double n) { return std::abs(n) > 0.85 ? (n > 0 ? gloss : -gloss) : 0.0; };
    return {part(normal.x), part(normal.y), std::max(0.0, part(normal.z))};
}

// Value of the column extra_level: so many additions of 0.01 in fp32, as training makes them.
float extraLevel(uint32_t steps)
{
    static const std::vector<float> sums = [] {
        std::vector<float> all = {0};
        while (all.size() <= kExtraSteps)
            all.push_back(all.back() + 0.01f);
        return all;
    }();
    return sums[steps];
}

Box cellBounds(const Surface& surface, const Cell& cell)
{
    Box bounds;
    const double us[2] = {cell.u0, cell.u1}, vs[2] = {cell.v0, cell.v1};
    for (int i = 0; i < 4; ++i) {
        const dvec3 p = surfacePoint(surface, us[i & 1], vs[i >> 1]).position;
        if (i == 0)
            bounds = {p, p};
        bounds = {glm::min(bounds.min, p), glm::max(bounds.max, p)};
    }
    // a round body bulges between the corners of a cell
    const double pad = 0.2 + 0.2 * std::max(cell.width, cell.height);
    return {bounds.min - pad, bounds.max + pad};
}

} // namespace

struct SurfaceRows::Patch {
    dvec3 center;
    dvec3 target[K]; // centres of the Gaussians, in metres
    dvec3 tone[K];   // logits of the Gaussians' colours
    dvec3 turn, gloss;
};

SurfaceRows::SurfaceRows(const SceneSpec& spec, const AnchorGrid& grid, SampleModel model, const SceneTile& tile)
    : m_spec(spec), m_grid(grid), m_octree(model == SampleModel::Octree), m_light(spec, tile),
      m_taken(grid, tile.bounded, tile.min, tile.max)
{
}

void SurfaceRows::evaluate(const Surface& surface, const Cell& cell, const NearOccluders& near, uint64_t key,
                           Patch& patch)
{
    const double width = std::sqrt(cell.width * cell.height / K);
    SurfacePoint middle = surfacePoint(surface, 0.5 * (cell.u0 + cell.u1), 0.5 * (cell.v0 + cell.v1));
    sampleMaterial(m_spec, surface, middle, width);
    patch.center = middle.position;
    patch.turn = turnOf(middle.tangent_u, middle.tangent_v, middle.normal);
    HashRandom random(key);
    double gloss = 0;
    dvec3 cell_light{};
    const bool one_light = m_spec.scene == SampleScene::Room && std::max(cell.width, cell.height) < kOneLightCell;
    for (uint32_t k = 0; k < K; ++k) {
        // the points (k, 3 k) mod 10 form a square lattice, which continues across cells
        const double a = (k + 0.5) / K, b = ((3 * k) % K + 0.5) / K;
        SurfacePoint p = surfacePoint(surface, lerp(cell.u0, cell.u1, a), lerp(cell.v0, cell.v1, b));
        if (surface.ragged > 0) {
            // twigs stand out by a share of the crown, however small the Gaussians are
            const double shift = surface.ragged * std::max(0.7 * width, 0.09 * surface.radii.x);
            const dvec3 jitter{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
            p.position += jitter * shift;
            p.normal = normalized(p.normal + jitter * (0.5 * surface.ragged));
        }
        const MaterialSample m = sampleMaterial(m_spec, surface, p, width);
        gloss += m.gloss / K;
        dvec3 display;
        if (surface.material == Material::Sky) {
            display = m.emission;
        } else {
            const bool lit = surface.share == AnchorShare::Main && dot(m.reflectance, m.reflectance) > 0;
            // note: a coarse level lies inside the body but must have the light of its surface
            const dvec3 at = p.position + p.normal * m_inset;
            if (lit && (k == 0 || !one_light))
                cell_light = m_light.irradiance(near, at, p.normal, width, m.wrap);
            display = displayColor(m.reflectance * cell_light + m.emission);
        }
        patch.target[k] = p.position;
        patch.tone[k] = {logit(display.x), logit(display.y), logit(display.z)};
    }
    patch.gloss = glossAxes(middle.normal, gloss);
}

void SurfaceRows::writeRow(const Surface& surface, const Cell& cell, uint32_t level, const Patch& patch,
                           const GridCell& at, uint64_t key)
{
    m_rows.resize(m_rows.size() + kSampleRowFloats);
    float* row = &m_rows[m_rows.size() - kSampleRowFloats];
    cellPosition(m_grid, level, at, row);
    float* next = row + 3; // normals, or level, extra_level and info
    if (m_octree) {
        // training raises extra_level where photographs have detail: here for whole objects, by different amounts
        const double object = hashUnit(surface.seed + 1), own = hashUnit(key + 1);
        next[0] = float(level);
        next[1] = object < 0.4 ? extraLevel(1 + uint32_t((object / 0.4 * 0.8 + 0.19 * own) * kExtraSteps)) : 0.0f;
    }
    float* offset = row + 6;
    float* feature = offset + 3 * K;
    float* scale = feature + kSampleFeatures + 1;

    const double step_u = cell.width / std::sqrt(K), step_v = cell.height / std::sqrt(K);
    const double share = surface.share != AnchorShare::Main ? kClosedSigma : m_inset > 0 ? kCoarseSigma : kSharpSigma;
    // coarse Gaussians must not stick out of small bodies
    const double largest = m_inset > 0 && !surface.flush ? 0.3 * m_body : 1e9;
    const double sigma_u = std::min(largest, share * step_u), sigma_v = std::min(largest, share * step_v);
    const double sigma[3] = {sigma_u, sigma_v, surface.thickness * std::min(sigma_u, sigma_v)};
    for (int axis = 0; axis < 3; ++axis) {
        double reach = 0.12 * std::max(cell.width, cell.height);
        for (uint32_t k = 0; k < K; ++k)
            reach = std::max(reach, std::abs(patch.target[k][axis] - double(row[axis])));
        scale[axis] = float(std::log(reach * (0.9 + 0.2 * hashUnit(key + 2 + uint64_t(axis)))));
        const double extent = std::exp(double(scale[axis]));
        for (uint32_t k = 0; k < K; ++k)
            offset[axis * K + k] = float((patch.target[k][axis] - double(row[axis])) / extent);
        scale[3 + axis] = float(std::log(sigma[axis] / double(kSizeShare)));
    }

    dvec3 base{};
    for (const dvec3& tone : patch.tone)
        base += tone * (1.0 / K);
    const auto within = [](double x, float limit) { return std::clamp(float(x), -limit, limit); };
    for (int i = 0; i < 3; ++i) {
        feature[kFeatureBase + uint32_t(i)] = within(base[i], kBaseLimit);
        feature[kFeatureTurn + uint32_t(i)] = within(patch.turn[i], kTurnLimit);
        feature[kFeatureGloss + uint32_t(i)] = float(patch.gloss[i]);
    }
    const dvec3 hue_axis = glm::make_vec3(kHueAxis);
    for (uint32_t k = 0; k < K; ++k) {
        const dvec3 rest = patch.tone[k] - base;
        const double light = (rest.x + rest.y + rest.z) / 3;
        feature[kFeatureLight + k] = within(light, kLightLimit);
        feature[kFeatureHue + k] = within(dot(rest, hue_axis) / dot(hue_axis, hue_axis), kHueLimit);
    }
    feature[kFeatureAlive] = 1;
    feature[kFeatureOpacity] = float(surface.ragged > 0 ? lerp(-0.3, 0.2, hashUnit(key + 7)) : 0.1);
    feature[kFeatureRagged] = float(surface.ragged);
    feature[kSampleFeatures] = kOpacityLogit;
    // rot_0 of the unit quaternion; the others stay 0
    scale[6] = 1;
}

void SurfaceRows::add(const Surface& original, uint32_t level, const CellLayout& layout, uint64_t first, uint64_t last)
{
    if (first == last)
        return;
    m_rows.reserve(m_rows.size() + (last - first) * kSampleRowFloats);
    Surface surface = original;
    if (level + 1 < m_grid.levels && surface.all_levels) {
        // note: splats are sorted by their centres, so one that is sunk shows in front of the surface at a distance
        // above depth / sin(2 angle) from its centre; at 45 degrees this is 2.8 sigma, where it is faint
        const double step = std::sqrt(surfaceArea(surface) / double(layout.count) / K);
        m_inset = step;
        m_body = surface.shape == Surface::Shape::Quad
                     ? 0.5 * std::min(original.texture_size[0], original.texture_size[1])
                     : std::min(surface.radii.x, surface.radii.z);
        surface = sunkSurface(surface, m_inset);
    } else {
        m_inset = 0;
    }
    const bool lit = surface.share == AnchorShare::Main;
    if (lit) {
        Box all = cellBounds(surface, {0, 1, 0, 1, 0, 0});
        if (surface.shape != Surface::Shape::Quad)
            all = {surface.center - surface.radii * 1.3, surface.center + surface.radii * 1.3};
        m_light.gather(all, nullptr, m_near_surface);
    }
    size_t row = 0;
    GridCell at{};
    for (uint64_t i = first; i < last; ++i) {
        const Cell cell = cellAt(surface, layout, i, row);
        const uint64_t key = hashKey(surface.seed, i,
                                     uint64_t(level) << 56 ^ uint64_t(int64_t(surface.reference.x * 8)) << 28 ^
                                         uint64_t(int64_t(surface.reference.y * 8)));
        if (lit)
            m_light.gather(cellBounds(surface, cell), &m_near_surface, m_near_cell);
        Patch patch;
        evaluate(surface, cell, m_near_cell, key, patch);
        const bool share_cell = m_octree && m_grid.levels > 1 && level + 1 == m_grid.levels && i > first &&
                                hashKey(key, 99) % kDuplicateEvery == 0;
        if (!share_cell)
            at = m_taken.take(level, cellOf(m_grid, level, patch.center));
        writeRow(surface, cell, level, patch, at, key);
    }
}

} // namespace gsc
