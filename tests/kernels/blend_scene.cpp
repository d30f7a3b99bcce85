// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/blend_scene.h"
#include "tests/kernels/synthetic_model.h"

namespace gsc::test {

namespace {

void setSplat(PackedSplat& s, const Ellipse& e, uint32_t order)
{
    const double det = double(e.a) * e.c - double(e.b) * e.b, half = 0.7213475204444817; // half of log2(e)
    const double along = std::sqrt(half * e.c / det);
    s = {e.x, e.y, {float(along), float(-e.b / e.c * along), float(std::sqrt(half / e.c))}, {}, 0, order};
    for (int i = 0; i < 3; ++i)
        s.color[i] = floatSteps(e.color[i]);
    s.opacity = floatSteps(e.opacity);
}
void setSplat(ExactSplat& s, const Ellipse& e, uint32_t order)
{
    const double det = double(e.a) * e.c - double(e.b) * e.b;
    s = {};
    s.x = e.x;
    s.y = e.y;
    s.conic[0] = float(e.c / det);
    s.conic[1] = float(-e.b / det);
    s.conic[2] = float(e.a / det);
    s.opacity = e.opacity;
    std::copy_n(e.color, 3, s.color);
    s.order = order;
    s.tx0 = uint16_t(e.tiles.x0);
    s.ty0 = uint16_t(e.tiles.y0);
    s.tx1 = uint16_t(e.tiles.x1);
    s.ty1 = uint16_t(e.tiles.y1);
}

// Log of a splat's alpha at a pixel, what rounding may move it by, and whether it is drawn there at all.
struct Falloff {
    double log_alpha, error, color[3];
    bool drawn, doubtful;
};

// Terms are rounded a few times each on the way to the exponent, whose function is good to 2 ulp.
constexpr double kTermRounding = 2.5e-7, kFunctionRounding = 6e-7;
// The tier `fast` adds up exponents near -126, where half a bit is 2^-18: the opacity's, and two sums; and the constant's own.
constexpr double kLiftedRounding = 4 * 0x1p-18;
constexpr uint32_t kBinSize = 32; // pixels at most, from whose first the tier `fast` counts

Falloff falloffAt(const PackedSplat& s, const RasterConstants& rules, uint32_t x, uint32_t y)
{
    constexpr double kLn2 = 0.6931471805599453;
    const double dx = double(s.x - float(x)), dy = double(s.y - float(y)),
                 log_opacity = std::log2(stepsFloat(s.opacity));
    const double f[3] = {s.factor[0], s.factor[1], s.factor[2]}, u = f[0] * dx + f[1] * dy, v = f[2] * dy;
    // u and v are differences of terms counted from the bin's first pixel, each rounded by half a bit
    const double px = x % kBinSize, py = y % kBinSize, far_x = 2 * std::abs(dx + px) + px,
                 far_y = 2 * std::abs(dy + py) + py;
    const double u_error = 6e-8 * (std::abs(f[0]) * far_x + std::abs(f[1]) * far_y), v_error = 6e-8 * f[2] * far_y;
    const double error = 2 * std::abs(u) * u_error + 2 * std::abs(v) * v_error +
                         kTermRounding * (u * u + v * v + std::abs(log_opacity)) + kLiftedRounding;
    // upstream's radius from the inverse of the covariance, rounded up: doubtful where it nearly is a whole number
    const double radius = spreadOf(s, rules).radius;
    const double trust =
        f[2] * f[2] / (3e-5 * (f[1] * f[1] + f[2] * f[2])); // a needle's determinant is too small to trust
    const double slack = radius * std::max(1e-3, 0.01 / trust);
    const bool drawn = !(trust > 1) || inTiles(s, rules, std::ceil(radius), x, y);
    const bool near_edge =
        inTiles(s, rules, std::ceil(radius - slack), x, y) != inTiles(s, rules, std::ceil(radius + slack), x, y);
    const bool doubtful = trust > 0.95 && (near_edge || (trust < 1.05 && !inTiles(s, rules, std::ceil(radius), x, y)));
    return {kLn2 * (log_opacity - u * u - v * v),
            kLn2 * error + kFunctionRounding,
            {stepsFloat(s.color[0]), stepsFloat(s.color[1]), stepsFloat(s.color[2])},
            drawn,
            doubtful};
}
Falloff falloffAt(const ExactSplat& s, const RasterConstants&, uint32_t x, uint32_t y)
{
    const double dx = double(s.x - float(x)), dy = double(s.y - float(y));
    const double terms[3] = {0.5 * s.conic[0] * dx * dx, double(s.conic[1]) * dx * dy, 0.5 * s.conic[2] * dy * dy};
    const double power = -terms[0] - terms[1] - terms[2];
    const double error = kTermRounding * (std::abs(terms[0]) + std::abs(terms[1]) + std::abs(terms[2]));
    const uint32_t tx = x / kTileSize, ty = y / kTileSize;
    const bool covered = tx >= s.tx0 && tx < s.tx1 && ty >= s.ty0 && ty < s.ty1;
    return {std::log(double(s.opacity)) + power,
            error + kFunctionRounding,
            {s.color[0], s.color[1], s.color[2]},
            covered && power <= 0,
            covered && error > 0 && std::abs(power) <= error};
}

} // namespace

Spread spreadOf(const PackedSplat& s, const RasterConstants& rules)
{
    constexpr double kHalf = 0.7213475204444817; // half of log2(e)
    const double a = s.factor[0], b = s.factor[1], c = s.factor[2];
    const double xx = kHalf * (b * b + c * c) / (a * c * a * c), yy = kHalf / (c * c), mid = 0.5 * (xx + yy);
    const double det = kHalf * kHalf / (a * c * a * c);
    return {xx, yy, 3 * std::sqrt(mid + std::sqrt(std::max(double(rules.eigen_floor), mid * mid - det)))};
}

bool inTiles(const PackedSplat& s, const RasterConstants& rules, double radius, uint32_t x, uint32_t y)
{
    const auto in = [&](double center, uint32_t pixel) {
        const double tile = std::floor(pixel / double(kTileSize));
        if (rules.gsplat)
            return tile >= std::floor((center + 0.5 - radius) / kTileSize) &&
                   tile < std::ceil((center + 0.5 + radius) / kTileSize);
        return tile >= std::floor((center - radius) / kTileSize) &&
               tile < std::floor((center + radius + kTileSize - 1) / kTileSize);
    };
    return in(double(s.x), x) && in(double(s.y), y);
}

template <typename Splat>
BlendScene<Splat> emptyScene(const std::vector<Size>& eyes, uint32_t bin_height, RasterRules raster)
{
    BlendScene<Splat> scene{};
    scene.eyes = eyes;
    scene.grid = {0, 0, bin_height, 2};
    for (const Size& eye : eyes) {
        scene.grid.columns = std::max(scene.grid.columns, (eye.width + kBinWidth - 1) / kBinWidth);
        scene.grid.rows = std::max(scene.grid.rows, (eye.height + bin_height - 1) / bin_height);
    }
    scene.lists.resize(eyes.size() * scene.grid.bins());
    scene.rules = rulesOf(raster);
    return scene;
}

template <typename Splat>
void addSplat(BlendScene<Splat>& scene, uint32_t eye, const Ellipse& ellipse)
{
    const auto index = uint32_t(scene.splats.size());
    scene.splats.emplace_back();
    setSplat(scene.splats.back(), ellipse, index);
    const int32_t tile_rows = int32_t(scene.grid.height / kTileSize);
    const int32_t right = int32_t((scene.eyes[eye].width + kBinWidth - 1) / kBinWidth) - 1;
    const int32_t bottom = int32_t((scene.eyes[eye].height + scene.grid.height - 1) / scene.grid.height) - 1;
    for (int32_t y = std::max(ellipse.tiles.y0 / tile_rows - 1, 0);
         y <= std::min(ellipse.tiles.y1 / tile_rows + 1, bottom); ++y)
        for (int32_t x = std::max(ellipse.tiles.x0 / 2 - 1, 0); x <= std::min(ellipse.tiles.x1 / 2 + 1, right); ++x)
            scene.lists[eye * scene.grid.bins() + uint32_t(y) * scene.grid.columns + uint32_t(x)].push_back(index);
}

template <typename Splat>
BlendScene<Splat> randomScene(const std::vector<Size>& eyes, uint32_t bin_height, RasterRules raster, uint32_t count,
                              uint32_t seed, const Shapes& shapes)
{
    BlendScene<Splat> scene = emptyScene<Splat>(eyes, bin_height, raster);
    Random random(seed);
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t eye = i % uint32_t(eyes.size());
        EyeParams params{};
        params.width = eyes[eye].width;
        params.height = eyes[eye].height;
        Ellipse e{};
        // from specks to streaks, of which the thinnest are 1 to 12
        const float s1 = std::exp(random.uniform(-0.6f, std::log(shapes.sigma_max)));
        const float s2 = i % 6 == 0 ? std::max(0.55f, s1 / 12) : std::exp(random.uniform(-0.6f, 2));
        const float angle = random.uniform(0, 3.14f), ca = std::cos(angle), sa = std::sin(angle);
        e.a = s1 * s1 * ca * ca + s2 * s2 * sa * sa;
        e.b = (s1 * s1 - s2 * s2) * ca * sa;
        e.c = s1 * s1 * sa * sa + s2 * s2 * ca * ca;
        if (shapes.hollow && i % 40 == 7)
            e.b = 1.1f * std::sqrt(e.a * e.c);
        e.x = random.uniform(-20, float(params.width) + 20);
        e.y = random.uniform(-20, float(params.height) + 20);
        e.opacity = random.uniform(shapes.opacity_min, shapes.opacity_max);
        for (float& c : e.color)
            c = random.uniform();
        const float det = e.a * e.c - e.b * e.b;
        e.tiles = tileRect<float>(params, scene.rules.gsplat, e.x, e.y,
                                  splatRadius<float>({e.a, e.b, e.c}, det, scene.rules.eigen_floor));
        if (!e.tiles.empty())
            addSplat(scene, eye, e);
    }
    return scene;
}

template <typename Splat>
Pixel referencePixel(const BlendScene<Splat>& scene, const std::vector<uint32_t>& list, uint32_t x, uint32_t y)
{
    Pixel pixel{};
    double left = 1, left_error = 0;
    for (const uint32_t i : list) {
        const Falloff f = falloffAt(scene.splats[i], scene.rules, x, y);
        if (!f.drawn && !f.doubtful)
            continue;
        const double alpha = std::min(double(scene.rules.alpha_cap), std::exp(f.log_alpha));
        const double rounding = alpha * f.error;
        const bool at_floor = std::abs(alpha - double(kOpacityFloor)) <= rounding;
        if (alpha < double(kOpacityFloor) && !at_floor)
            continue;
        const double alpha_error = at_floor || f.doubtful ? alpha : rounding;
        if (f.drawn && alpha >= double(kOpacityFloor)) {
            const double next = left * (1 - alpha);
            if (std::abs(next - double(scene.rules.stop)) <= left_error + left * (alpha_error + 1e-6))
                pixel.bound += left;
            pixel.depth_doubtful |= std::abs(next - 0.5) <= left_error + left * (alpha_error + 1e-6);
            if (left >= 0.5 && next < 0.5)
                pixel.depth = float(i + 1);
            if (scene.rules.gsplat ? next <= double(scene.rules.stop) : next < double(scene.rules.stop))
                break;
            for (int c = 0; c < 3; ++c)
                pixel.color[c] += f.color[c] * alpha * left;
            pixel.bound += alpha * left_error + left * alpha_error + alpha * left * 2e-7;
            left_error = left_error * (1 - alpha) + left * alpha_error + left * 2e-7;
            left = next;
        } else {
            const bool may_finish = left * (1 - alpha) < double(scene.rules.stop) * (1 + 1e-3) + left_error;
            pixel.bound += may_finish ? left : left * alpha_error;
            pixel.depth_doubtful |= left >= 0.5 && left * (1 - alpha) < 0.5 + left_error;
            left_error += left * alpha_error;
        }
    }
    for (int c = 0; c < 3; ++c)
        pixel.color[c] += left * double(scene.background[c]);
    pixel.bound += left_error + 5e-7; // the sum's own rounding
    return pixel;
}

template BlendScene<PackedSplat> emptyScene<PackedSplat>(const std::vector<Size>&, uint32_t, RasterRules);
template void addSplat<PackedSplat>(BlendScene<PackedSplat>&, uint32_t, const Ellipse&);
template BlendScene<PackedSplat> randomScene<PackedSplat>(const std::vector<Size>&, uint32_t, RasterRules, uint32_t,
                                                          uint32_t, const Shapes&);
template Pixel referencePixel<PackedSplat>(const BlendScene<PackedSplat>&, const std::vector<uint32_t>&, uint32_t,
                                           uint32_t);
template BlendScene<ExactSplat> emptyScene<ExactSplat>(const std::vector<Size>&, uint32_t, RasterRules);
template void addSplat<ExactSplat>(BlendScene<ExactSplat>&, uint32_t, const Ellipse&);
template BlendScene<ExactSplat> randomScene<ExactSplat>(const std::vector<Size>&, uint32_t, RasterRules, uint32_t,
                                                        uint32_t, const Shapes&);
template Pixel referencePixel<ExactSplat>(const BlendScene<ExactSplat>&, const std::vector<uint32_t>&, uint32_t,
                                          uint32_t);

} // namespace gsc::test
