// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model/hash_random.h"
#include "convert/sample/scenes/lighting.h"
#include "convert/sample/scenes/materials.h"

namespace gsc {

namespace {

dvec3 parquet(const Surface& s, const SurfacePoint& p, double w)
{
    constexpr double kPlank = 0.14, kLength = 1.3;
    const double row = std::floor(p.t / kPlank);
    const double shift = hashUnit(hashKey(uint64_t(int64_t(row)), 3)) * kLength;
    const double column = std::floor((p.s + shift) / kLength);
    const double tone = hashUnit(hashKey(uint64_t(int64_t(row)), uint64_t(int64_t(column)), 4));
    const double grain = fractalNoise(p.s * 3, p.t * 40, 5, 2);
    const double joint =
        std::max(pulse(p.t / kPlank, 0, 0.04, w / kPlank), pulse((p.s + shift) / kLength, 0, 0.005, w / kLength));
    return lerp(s.color * (0.72 + 0.5 * tone + 0.2 * (grain - 0.5)), s.color * 0.35, joint);
}

dvec3 rug(const Surface& s, const SurfacePoint& p, double w)
{
    const double edge = std::min({p.s, p.t, s.texture_size[0] - p.s, s.texture_size[1] - p.t});
    const dvec3 cream{0.66, 0.58, 0.44}, navy{0.06, 0.09, 0.17};
    dvec3 color = s.color;
    const double cell = 0.31;
    const double u = p.s / cell + 0.5, v = p.t / cell + 0.5;
    const double diamond = std::abs(u - std::floor(u) - 0.5) + std::abs(v - std::floor(v) - 0.5);
    color = lerp(color, cream, band(diamond, 0.36, 0.44, w / cell));
    color = lerp(color, navy, band(diamond, -1, 0.2, w / cell));
    color = lerp(color, navy, band(edge, -1, 0.26, w));
    color = lerp(color, cream, band(edge, 0.05, 0.08, w) + band(edge, 0.2, 0.23, w));
    return color * (0.85 + 0.3 * valueNoise(p.s * 60, p.t * 60, 6));
}

dvec3 books(const Surface& s, const SurfacePoint& p, double w)
{
    static constexpr dvec3 kCovers[] = {{0.45, 0.09, 0.06}, {0.07, 0.17, 0.30}, {0.58, 0.50, 0.36}, {0.08, 0.20, 0.11},
                                        {0.50, 0.30, 0.06}, {0.12, 0.11, 0.12}, {0.60, 0.58, 0.54}, {0.30, 0.10, 0.20}};
    // metres, average width of a book's spine; each boundary is shifted at random
    constexpr double kSpine = 0.042;
    double index = std::floor(p.s / kSpine);
    const double cut = 0.35 * (hashUnit(hashKey(s.seed, uint64_t(int64_t(index)))) - 0.5);
    if (p.s / kSpine - index < 0.18 + cut)
        index -= 1;
    const uint64_t key = hashKey(s.seed, uint64_t(int64_t(index)), 9);
    const double height = 0.22 + 0.10 * hashUnit(key + 1);
    if (hashUnit(key + 2) < 0.06)
        // a missing book
        return {0.02, 0.015, 0.01};
    const dvec3 cover = kCovers[key % 8] * (0.8 + 0.4 * hashUnit(key + 3));
    const double title = band(p.t, 0.55 * height, 0.7 * height, w) * 0.6;
    return lerp(lerp(dvec3{0.02, 0.015, 0.01}, cover, band(p.t, 0, height, w)), {0.6, 0.5, 0.25}, title);
}

dvec3 painting(const Surface& s, const SurfacePoint& p, double w)
{
    const double u = p.s / s.texture_size[0], v = p.t / s.texture_size[1];
    const double mat = std::min({p.s, p.t, s.texture_size[0] - p.s, s.texture_size[1] - p.t});
    // hills one behind the other, under an evening sky
    dvec3 color = lerp(dvec3{0.72, 0.42, 0.20}, {0.16, 0.28, 0.46}, std::clamp(1.6 * v - 0.5, 0.0, 1.0));
    const double du = u - 0.62, dv = v - 0.66;
    color = lerp(color, {0.85, 0.66, 0.34},
                 1 - smoothstep(0.05, 0.075, std::hypot(du * s.texture_size[0] / s.texture_size[1], dv)));
    for (int i = 0; i < 4; ++i) {
        const double ridge =
            0.58 - 0.13 * i + 0.16 * (fractalNoise(u * (2 + i) + 7 * i, 0.5, s.seed + uint64_t(i), 3) - 0.5);
        const dvec3 tone = lerp(dvec3{0.34, 0.34, 0.42}, {0.05, 0.10, 0.07}, i / 3.0);
        color = lerp(tone, color, smoothstep(-0.01 - w, 0.01 + w, v - ridge));
    }
    return lerp(color, {0.74, 0.72, 0.67}, band(mat, -1, 0.06, w));
}

// Colour of the garden that is seen through the window.
dvec3 windowView(const Surface& s, const SurfacePoint& p, double w)
{
    const double u = p.s, v = p.t;
    dvec3 color = lerp(dvec3{1.7, 1.75, 1.8}, {0.75, 1.15, 1.8}, std::clamp(v / 1.4, 0.0, 1.0));
    const double trees = 0.62 + 0.3 * (fractalNoise(u * 2.2, 3, 21, 3) - 0.5);
    const double leaf = fractalNoise(u * 9, v * 9, 22, 3);
    color = lerp(dvec3{0.16, 0.34, 0.08} * (0.5 + 1.3 * leaf), color, smoothstep(-0.04, 0.04, v - trees));
    color = lerp(dvec3{0.42, 0.62, 0.16} * (0.8 + 0.4 * leaf), color, smoothstep(0.22, 0.28, v));
    const double frame = std::min({u, v, s.texture_size[0] - u, s.texture_size[1] - v});
    const double bars = std::max(band(std::abs(u - 0.5 * s.texture_size[0]), -1, 0.035, w), band(frame, -1, 0.06, w));
    return lerp(color, {0.62, 0.62, 0.60}, std::min(1.0, bars));
}

} // namespace

MaterialSample sampleRoomMaterial(const Surface& s, const SurfacePoint& p, double w)
{
    switch (s.material) {
    case Material::Parquet:
        return {.reflectance = parquet(s, p, w), .gloss = 0.35};
    case Material::Rug:
        return {.reflectance = rug(s, p, w)};
    case Material::RoomWall: {
        const dvec3 paint = s.color * (0.97 + 0.06 * fractalNoise(p.s * 2, p.t * 2, s.seed, 2));
        // walls only: the ceiling has no skirting board
        if (std::abs(p.normal.z) >= 0.5)
            return {.reflectance = paint};
        return {.reflectance = lerp(paint, {0.76, 0.75, 0.72}, band(p.position.z, -1, 0.09, w))};
    }
    case Material::Books:
        return {.reflectance = books(s, p, w)};
    case Material::Painting:
        return {.reflectance = painting(s, p, w)};
    case Material::WindowView:
        return {.emission = windowView(s, p, w)};
    case Material::Wood: {
        const double grain = fractalNoise(p.s * 6, p.t * 30, s.seed, 3);
        return {.reflectance = s.color * (0.75 + 0.5 * grain), .gloss = 0.2};
    }
    case Material::Fabric: {
        // folds, if the fabric is a curtain (higher than 2 m)
        const double fold = s.texture_size[1] > 2 ? 0.25 * std::sin(p.s * 42) : 0;
        return {.reflectance = s.color * (0.9 + fold + 0.2 * valueNoise(p.s * 50, p.t * 50, s.seed)), .wrap = 0.2};
    }
    default:
        return {};
    }
}

} // namespace gsc
