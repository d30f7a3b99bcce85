// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/materials.h"

#include "convert/sample/model/hash_random.h"
#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

constexpr dvec3 kAsphalt{0.085, 0.085, 0.09};
constexpr dvec3 kMarking{0.62, 0.62, 0.58};
constexpr dvec3 kPavement{0.34, 0.32, 0.29};
constexpr dvec3 kGrass{0.115, 0.21, 0.045};

dvec3 grassAt(double x, double y, uint64_t seed)
{
    const double large = fractalNoise(x * 0.11, y * 0.11, seed, 2), fine = valueNoise(x * 0.9, y * 0.9, seed + 3);
    return kGrass * (0.72 + 0.4 * large + 0.2 * fine) + dvec3{0.05, 0.03, 0} * large;
}

MaterialSample cityGround(const Surface& s, const SurfacePoint& p, double w)
{
    const double x = p.position.x - s.reference.x, y = p.position.y - s.reference.y;
    const double ax = std::abs(x), ay = std::abs(y);
    const double gx = p.position.x, gy = p.position.y;
    const double outer = std::max(ax, ay);

    dvec3 lot;
    switch (LotKind(int(s.param[0]))) {
    case LotKind::Paved: {
        const double joint = std::max(pulse(gx / 3, 0, 0.08, w / 3), pulse(gy / 3, 0, 0.08, w / 3));
        lot = lerp(dvec3{0.42, 0.39, 0.34}, {0.28, 0.26, 0.23}, joint);
        break;
    }
    case LotKind::Park: {
        // paths along the diagonals and the edges of the park
        const double diagonal = std::abs(ax - ay) * 0.7071;
        const double path = std::max(band(diagonal, -1.3, 1.3, w), band(outer, 20.6, 22.6, w));
        lot = lerp(grassAt(gx, gy, 5), {0.46, 0.39, 0.29}, path);
        break;
    }
    case LotKind::Court:
        lot = lerp(grassAt(gx, gy, 6), {0.40, 0.34, 0.26}, band(outer, 8.6, 10.6, w));
        break;
    default:
        lot = grassAt(gx, gy, 7);
        break;
    }
    const double paved = band(outer, 22.9, 26, w), road = band(outer, 26, 40, w);
    dvec3 color = lerp(lot, kPavement * (0.92 + 0.16 * valueNoise(gx * 0.7, gy * 0.7, 8)), paved);
    color = lerp(color, kAsphalt * (0.85 + 0.3 * fractalNoise(gx * 0.35, gy * 0.35, 9, 2)), road);
    color = lerp(color, {0.5, 0.48, 0.45}, 0.8 * band(outer, 25.8, 26.1, w)); // the kerb between pavement and road

    const bool crossing = ax > 25.9 && ay > 25.9;
    if (!crossing && road > 0) {
        const double across = ax > ay ? ax : ay, along = ax > ay ? y : x;
        double mark =
            band(across, 29.82, 30.2, w) * pulse(along / 5, 0.2, 0.8, w / 5) * band(std::abs(along), 0, 21.5, w);
        // zebra crossings at both ends of the block
        mark = std::max(mark, band(std::abs(along), 22.6, 25.4, w) * pulse(across / 1.3, 0.1, 0.6, w / 1.3) *
                                  band(across, 26.3, 30, w));
        color = lerp(color, kMarking, 0.9 * mark);
    }
    return {.reflectance = color};
}

MaterialSample streetGround(const SurfacePoint& p, double w)
{
    const double x = p.position.x, y = p.position.y, ay = std::abs(y);
    const double road = band(ay, -1, 4.2, w);
    const double joint = std::max(pulse(x / 0.8, 0, 0.05, w / 0.8), pulse(y / 0.8, 0, 0.05, w / 0.8));
    dvec3 slabs =
        kPavement *
        (1.05 + 0.22 * (hashUnit(uint64_t(int64_t(std::floor(x / 0.8)) * 977 + int64_t(std::floor(y / 0.8)))) - 0.5));
    slabs = lerp(slabs, kPavement * 0.6, joint);
    const double worn = fractalNoise(x * 0.5, y * 0.8, 12, 3);
    dvec3 asphalt = kAsphalt * (0.75 + 0.5 * worn);
    double mark = band(ay, 0, 0.09, w) * pulse(x / 4, 0.25, 0.75, w / 4);
    mark = std::max(mark, band(ay, 1.95, 2.05, w) * pulse(x / 5.5, 0, 0.92, w / 5.5)); // lines of parking bays
    asphalt = lerp(asphalt, kMarking, 0.85 * mark);
    // the kerb between pavement and road
    return {.reflectance = lerp(lerp(slabs, asphalt, road), {0.46, 0.44, 0.41}, band(ay, 4.1, 4.35, w))};
}

// Colour of a window: a mirrored sky that is brighter higher up, with a dark room or a curtain behind it.
dvec3 windowColor(uint64_t seed, double bay, double floor, double height_share, double fade)
{
    const uint64_t key = seed ^ (uint64_t(int64_t(bay) + 512) << 24) ^ uint64_t(int64_t(floor) + 512);
    const double a = lerp(0.5, hashUnit(key), fade), b = hashUnit(key + 1);
    dvec3 color = lerp(dvec3{0.025, 0.035, 0.05}, {0.14, 0.21, 0.30}, 0.15 + 0.5 * a + 0.3 * height_share);
    if (b < 0.13)
        color = lerp(color, {0.42, 0.36, 0.26}, 0.7 * fade);
    return color;
}

MaterialSample facade(const Surface& s, const SurfacePoint& p, double w)
{
    const double width = s.texture_size[0], height = s.texture_size[1];
    const double bay = s.param[0], floor_height = s.param[1];
    const double shop_height = s.param[5] > 0 && height > 7 ? 4.0 : 0.0;
    const double t = p.t - shop_height;
    const double floors = std::floor((height - shop_height - 0.8) / floor_height);
    const double in_floors = band(t, 0, floors * floor_height, w) * band(p.s, 0.15, width - 0.15, w);

    const double stain = fractalNoise(p.s * 0.3 + double(s.seed % 97), p.t * 0.15, s.seed, 2);
    dvec3 wall = s.color * (0.88 + 0.24 * stain);
    // horizontal bands between floors, and a cornice
    const double line = pulse(t / floor_height, 0.0, 0.07, w / floor_height) * (s.param[4] < 2 ? 1 : 0.2) * in_floors;
    wall = lerp(wall, s.accent, 0.6 * line);
    wall = lerp(wall, s.accent, band(p.t, height - 0.8, height + 1, w));

    const double half_x = 0.5 * s.param[2], sill = 0.5 - 0.5 * s.param[3] + 0.04;
    const double u = p.s / bay, v = t / floor_height;
    const double glass =
        pulse(u, 0.5 - half_x, 0.5 + half_x, w / bay) * pulse(v, sill, sill + s.param[3], w / floor_height) * in_floors;
    constexpr double kFrame = 0.09; // metres of window frame
    const double fx = kFrame / bay, fy = kFrame / floor_height;
    const double framed = pulse(u, 0.5 - half_x - fx, 0.5 + half_x + fx, w / bay) *
                          pulse(v, sill - 1.6 * fy, sill + s.param[3] + fy, w / floor_height) * in_floors;
    const double mullion = s.param[4] == 0 ? pulse(u, 0.49, 0.51, w / bay) : 0;
    const double pane = glass * (1 - mullion);

    const double fade = 1 / (1 + (w / bay) * (w / bay));
    dvec3 mirror = windowColor(s.seed, std::floor(u), std::floor(v), std::clamp(p.t / 60, 0.0, 1.0), fade);
    wall = lerp(wall, s.param[4] == 0 ? dvec3{0.66, 0.64, 0.60} : s.accent * 0.7, std::max(0.0, framed - pane));
    double shiny = pane;
    if (shop_height > 0) {
        const double shops = band(p.t, 0, shop_height, w);
        const double unit = width / std::max(1.0, std::round(width / 5.5));
        const double shop = std::floor(p.s / unit);
        const uint64_t key = hashKey(s.seed, uint64_t(int64_t(shop) + 64), 5);
        const double front = pulse(p.s / unit, 0.06, 0.94, w / unit) * band(p.t, 0.45, 2.8, w) *
                             (1 - pulse(p.s / unit * 3, 0.0, 0.05, 3 * w / unit));
        const double sign = pulse(p.s / unit, 0.04, 0.96, w / unit) * band(p.t, 2.95, 3.6, w);
        static constexpr dvec3 kSigns[] = {{0.45, 0.06, 0.05}, {0.04, 0.16, 0.32}, {0.05, 0.25, 0.12},
                                           {0.55, 0.38, 0.05}, {0.08, 0.08, 0.09}, {0.5, 0.48, 0.44},
                                           {0.32, 0.08, 0.24}};
        wall = lerp(wall, s.accent * 0.75, shops);
        wall = lerp(wall, kSigns[key % 7], shops * sign);
        const dvec3 inside =
            lerp(dvec3{0.05, 0.05, 0.055}, dvec3{0.50, 0.38, 0.22}, 0.65 * hashUnit(key + 2) * band(p.t, 1.0, 2.8, w));
        mirror = lerp(mirror, inside, shops);
        shiny = lerp(shiny, front, shops);
    }
    return {.reflectance = wall * (1 - shiny), .emission = mirror * shiny, .gloss = shiny};
}

double terrainHeight(const Surface& s, double x, double y)
{
    const double e = s.param[0], r = std::max(std::abs(x), std::abs(y));
    const double far = smoothstep(1.25, 4.5, r / e);
    double height = far * e * 0.55 * std::pow(fractalNoise(x / (1.7 * e) + 11, y / (1.7 * e), 91, 4), 1.6);
    height += smoothstep(1.0, 1.5, r / e) * 9 * fractalNoise(x / 90, y / 90, 92, 2) * std::min(1.0, e / 150);
    const double shore = std::abs(y - s.param[2]);
    return lerp(-2.5, height, smoothstep(14.0, 60.0, shore)) * smoothstep(e, e * 1.02, r);
}

MaterialSample terrain(const SceneSpec& spec, const Surface& s, SurfacePoint& p, double w)
{
    const double x = p.position.x, y = p.position.y, e = s.param[0];
    const double step = std::max(1.0, w);
    p.position.z = terrainHeight(s, x, y);
    p.normal =
        normalized({p.position.z - terrainHeight(s, x + step, y), p.position.z - terrainHeight(s, x, y + step), step});
    p.tangent_u = normalized(cross(dvec3{0, 1, 0}, p.normal));
    p.tangent_v = cross(p.normal, p.tangent_u);

    // fields: each point belongs to the nearest of some random points, and a hedge grows where two are equally near
    const double warp = 40 * (fractalNoise(x / 260, y / 260, 61, 2) - 0.5);
    const double fx = (x + warp) / 125, fy = (0.25 * x + y - warp) / 88;
    double nearest = 1e9, second = 1e9;
    uint64_t parcel = 0;
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            const double gx = std::floor(fx) + i, gy = std::floor(fy) + j;
            const uint64_t key = hashKey(uint64_t(int64_t(gx)), uint64_t(int64_t(gy)), 17);
            const double dx = gx + 0.15 + 0.7 * hashUnit(key) - fx, dy = gy + 0.15 + 0.7 * hashUnit(key + 1) - fy;
            const double distance = std::sqrt(dx * dx + dy * dy);
            second = std::min(second, std::max(distance, nearest));
            parcel = distance < nearest ? key : parcel;
            nearest = std::min(nearest, distance);
        }
    static constexpr dvec3 kCrops[] = {{0.115, 0.21, 0.05}, {0.15, 0.24, 0.06}, {0.30, 0.27, 0.10}, {0.36, 0.31, 0.14},
                                       {0.09, 0.17, 0.05},  {0.19, 0.17, 0.09}, {0.13, 0.22, 0.07}, {0.17, 0.25, 0.07}};
    dvec3 color = kCrops[parcel % 8] * (0.88 + 0.24 * fractalNoise(x / 24, y / 24, 62, 2));
    const double hedge = 1 - smoothstep(0.03, 0.06 + w / 160, second - nearest);
    color = lerp(color, {0.05, 0.10, 0.025}, 0.6 * hedge / (1 + w / 25));
    const double forest = smoothstep(0.53, 0.60, fractalNoise(x / 330 + 4, y / 330, 63, 3));
    color = lerp(color, dvec3{0.045, 0.095, 0.03} * (0.7 + 0.6 * valueNoise(x / 9, y / 9, 64)), forest);

    const double water = 1 - smoothstep(15.5 - 0.5 * w, 16.5 + 0.5 * w, std::abs(y - s.param[2]));
    const double shade = 0.25 + 1.05 * std::max(0.0, dot(p.normal, sunDirection(spec.scene)));
    color = lerp(color, {0.05, 0.11, 0.13}, water);
    // haze with distance; the colour is returned as emission, because the light of the scene has no shadows out here
    const double far = std::max(0.0, std::hypot(x, y) - e);
    const double haze = 0.93 * (1 - std::exp(-far / (0.30 * s.param[1])));
    const dvec3 lit = color * (1.55 * shade + 0.15);
    return {.emission = lerp(lit, {0.50, 0.62, 0.78}, haze), .gloss = water};
}

} // namespace

double band(double x, double a, double b, double w)
{
    w = std::max(w, 1e-6);
    const double low = std::max(a, x - 0.5 * w), high = std::min(b, x + 0.5 * w);
    return std::max(0.0, high - low) / w;
}

double pulse(double x, double a, double b, double w)
{
    w = std::max(w, 1e-6);
    const double length = b - a;
    const auto integral = [&](double t) {
        const double cell = std::floor(t - a);
        return cell * length + std::min(t - a - cell, length);
    };
    return (integral(x + 0.5 * w) - integral(x - 0.5 * w)) / w;
}

dvec3 skyColor(dvec3 d, uint64_t seed)
{
    const double up = std::clamp(d.z, 0.0, 1.0);
    dvec3 color = lerp(dvec3{0.80, 0.87, 0.94}, {0.29, 0.52, 0.83}, std::pow(up, 0.55));
    const dvec3 sun = normalized({-0.62, -0.42, 0.62});
    const double glow = std::max(0.0, dot(d, sun));
    color = lerp(color, {1.0, 0.96, 0.86}, 0.45 * std::pow(glow, 10.0));
    if (d.z > 0.02) {
        const double k = 1.1 / (d.z + 0.22);
        const double cover = fractalNoise(d.x * k * 1.9 + 3.7, d.y * k * 1.9, seed, 5);
        const double cloud = smoothstep(0.52, 0.74, cover) * smoothstep(0.02, 0.16, d.z);
        const double thick = smoothstep(0.60, 0.85, cover);
        color = lerp(color, lerp(dvec3{0.97, 0.97, 0.97}, {0.80, 0.83, 0.88}, thick), 0.85 * cloud);
    }
    return color;
}

MaterialSample sampleMaterial(const SceneSpec& spec, const Surface& s, SurfacePoint& p, double w)
{
    const double x = p.position.x, y = p.position.y, z = p.position.z;
    switch (s.material) {
    case Material::CityGround:
        return cityGround(s, p, w);
    case Material::StreetGround:
        return streetGround(p, w);
    case Material::Facade:
        return facade(s, p, w);
    case Material::Terrain:
        return terrain(spec, s, p, w);
    case Material::Plain:
        return {.reflectance = s.color * (0.93 + 0.14 * valueNoise(x * 0.8 + z, y * 0.8 + z, s.seed))};
    case Material::FlatRoof: {
        const double rim = std::min({p.s, p.t, s.texture_size[0] - p.s, s.texture_size[1] - p.t});
        const dvec3 felt = s.color * (0.85 + 0.3 * fractalNoise(x * 0.25, y * 0.25, s.seed, 2));
        return {.reflectance = lerp(felt, {0.55, 0.53, 0.50}, band(rim, -1, 0.45, w))};
    }
    case Material::TileRoof: {
        const double row = pulse(p.t / 0.7, 0, 0.35, w / 0.7);
        const double worn = 0.22 * (fractalNoise(p.s * 0.5, p.t * 0.5, s.seed, 2) - 0.5);
        return {.reflectance = s.color * (0.82 + 0.3 * row + worn)};
    }
    case Material::Foliage: {
        const double level = std::clamp((z - s.param[0]) / (s.param[1] - s.param[0]), 0.0, 1.0);
        const double clump = valueNoise(x * 1.7 + z * 1.1, y * 1.7 - z * 0.9, s.seed);
        const double leaf =
            hashUnit(hashKey(s.seed, uint64_t(int64_t(x * 31)), uint64_t(int64_t(y * 31) * 7 + int64_t(z * 31))));
        const dvec3 green = s.color * ((0.45 + 0.65 * level) * (0.6 + 0.8 * clump) * (0.88 + 0.24 * leaf));
        return {.reflectance = green + dvec3{0.03, 0.02, 0} * (level * clump), .wrap = 0.45};
    }
    case Material::Bark:
        return {.reflectance = s.color * (0.8 + 0.4 * valueNoise(x * 9 + y * 9, z * 2, s.seed))};
    case Material::Water: {
        const double ripple = fractalNoise(x * 0.12, y * 0.35, s.seed, 3);
        return {.reflectance = s.color * (0.7 + 0.3 * ripple),
                .emission = dvec3{0.035, 0.06, 0.075} * (0.7 + 0.6 * ripple),
                .gloss = 1};
    }
    case Material::Sky:
        return {.emission = skyColor(normalized(p.position), s.seed)};
    case Material::CarPaint: // wheels and dark sills
        return {.reflectance = z < 0.42 ? dvec3{0.02, 0.02, 0.02} : s.color, .gloss = 0.5};
    case Material::CarGlass:
        return {.emission = {0.05, 0.07, 0.09}, .gloss = 1};
    case Material::Glow:
        return {.emission = s.color};
    default:
        return sampleRoomMaterial(s, p, w);
    }
}

} // namespace gsc
