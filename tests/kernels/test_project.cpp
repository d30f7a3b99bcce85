// SPDX-License-Identifier: Apache-2.0
// Fast projection against the scalar reference: same splats, same numbers, a box that holds every drawn pixel.
#include "kernels/project/project.h"
#include "kernels/math/blend.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

// A block filled by hand.
struct Block {
    explicit Block(const std::vector<GaussianOf<float>>& gaussians) : values(14 * (gaussians.size() + kMaxLanes))
    {
        const size_t room = gaussians.size() + kMaxLanes;
        float* p = values.data();
        const auto take = [&p, room] {
            p += room;
            return p - room;
        };
        for (int c = 0; c < 3; ++c) {
            block.position[c] = take();
            block.scale[c] = take();
            block.color[c] = take();
        }
        for (float*& r : block.rotation)
            r = take();
        block.opacity = take();
        for (size_t i = 0; i < gaussians.size(); ++i) {
            const GaussianOf<float>& g = gaussians[i];
            for (int c = 0; c < 3; ++c) {
                block.position[c][i] = g.position[c];
                block.scale[c][i] = g.scale[c];
                block.color[c][i] = g.color[c];
            }
            for (int c = 0; c < 4; ++c)
                block.rotation[c][i] = g.rotation[c];
            block.opacity[i] = g.opacity;
            origins.push_back(uint16_t(i));
        }
        block.origin = origins.data();
        block.count = uint32_t(gaussians.size());
        block.any_positive = true;
    }

    std::vector<float> values;
    std::vector<uint16_t> origins;
    GaussianBlock block{};
};

std::vector<GaussianOf<float>> randomGaussians(uint32_t count, uint32_t seed)
{
    Random random(seed);
    std::vector<GaussianOf<float>> gaussians(count);
    for (uint32_t i = 0; i < count; ++i) {
        GaussianOf<float>& g = gaussians[i];
        for (int c = 0; c < 3; ++c) {
            g.position[c] = random.uniform(-5, 5);
            // some needles, some specks, some larger than the image
            g.scale[c] = std::exp(random.uniform(-7, i % 10 == 0 ? 2.0f : -1.0f));
            g.color[c] = random.uniform();
        }
        for (float& v : g.rotation)
            v = random.normal();
        normalizeQuaternion(g.rotation);
        g.opacity = i % 7 == 0 ? kOpacityFloor : random.uniform(kOpacityFloor, 1);
        g.order = i;
    }
    return gaussians;
}

double relative(double a, double b)
{
    return std::abs(a - b) / (std::abs(b) + 1e-6);
}

// Every pixel at which the reference's splat reaches alpha 1/255 lies in the box and passes the cutoff.
void checkBox(const EyeParams& eye, const SplatOf<float>& expected, const Splat& splat)
{
    const uint32_t right = std::min<uint32_t>(uint32_t(expected.tiles.x1) * kTileSize, eye.width);
    const uint32_t bottom = std::min<uint32_t>(uint32_t(expected.tiles.y1) * kTileSize, eye.height);
    bool contained = true;
    for (uint32_t y = uint32_t(expected.tiles.y0) * kTileSize; y < bottom; ++y)
        for (uint32_t x = uint32_t(expected.tiles.x0) * kTileSize; x < right; ++x) {
            const float power = gaussianPower(expected.conic, expected.x - float(x), expected.y - float(y));
            if (power > 0 || expected.opacity * std::exp(power) < kOpacityFloor)
                continue;
            contained &= x >= splat.x0 && x <= splat.x1 && y >= splat.y0 && y <= splat.y1 && power >= -splat.cutoff;
        }
    CHECK(contained);
}

bool drawsNothing(const EyeParams& eye, const SplatOf<float>& s)
{
    for (int32_t y = s.tiles.y0 * 16; y < std::min(s.tiles.y1 * 16, int32_t(eye.height)); ++y)
        for (int32_t x = s.tiles.x0 * 16; x < std::min(s.tiles.x1 * 16, int32_t(eye.width)); ++x) {
            const float power = gaussianPower(s.conic, s.x - float(x), s.y - float(y));
            if (power <= 0 && s.opacity * std::exp(power) >= kOpacityFloor)
                return false;
        }
    return true;
}

void checkProjection(RasterRules raster, const EyeParams& eye, const std::vector<GaussianOf<float>>& gaussians)
{
    const RasterConstants rules = rulesOf(raster);
    uint64_t dropped = 0;
    const auto expected = projectReference<float>(eye, rules, gaussians, dropped);
    Block block(gaussians);
    std::vector<Splat> splats(gaussians.size() + 1);
    std::vector<uint32_t> depths(gaussians.size() + 1);
    std::vector<uint16_t> origins(gaussians.size() + 1, 0xabcd);
    ReadAhead ahead;
    ahead.add(gaussians.data(), gaussians.size() * sizeof(gaussians[0]));
    const ProjectCounts counts =
        projectBlockCpu({&eye, rules, &ahead}, block.block, splats.data(), depths.data(), origins.data());
    CHECK(ahead.lines() == 0);
    CHECK(counts.dropped == dropped);
    CHECK(origins[counts.splats] == 0xabcd);
    size_t at = 0;
    for (const SplatOf<float>& e : expected) {
        if (at == counts.splats || origins[at] != e.order) {
            CHECK(drawsNothing(eye, e)); // culled by the 1/255 ellipse
            continue;
        }
        const Splat& s = splats[at];
        float depth;
        std::memcpy(&depth, &depths[at], sizeof(depth));
        CHECK(relative(depth, e.depth) < 1e-6);
        CHECK(std::abs(s.x - e.x) < 1e-3 + 1e-6 * std::abs(e.x));
        CHECK(std::abs(s.y - e.y) < 1e-3 + 1e-6 * std::abs(e.y));
        const double norm = std::abs(e.conic[0]) + std::abs(e.conic[1]) + std::abs(e.conic[2]);
        for (int c = 0; c < 3; ++c) {
            CHECK(std::abs(s.conic[c] - e.conic[c]) < 1e-5 * norm * std::max(1.0, norm * 1e3));
            CHECK(s.color[c] == e.color[c]);
        }
        CHECK(s.opacity == e.opacity);
        // upstream's tiles are never exceeded
        CHECK(int32_t(s.x0 / kTileSize) >= e.tiles.x0);
        CHECK(int32_t(s.x1 / kTileSize) < e.tiles.x1);
        CHECK(int32_t(s.y0 / kTileSize) >= e.tiles.y0);
        CHECK(int32_t(s.y1 / kTileSize) < e.tiles.y1);
        CHECK(s.x1 < eye.width);
        CHECK(s.y1 < eye.height);
        checkBox(eye, e, s);
        ++at;
    }
    CHECK(at == counts.splats);
}

} // namespace

TEST_CASE("trap 26: boxes cut nothing that upstream draws, and stay within its tiles")
{
    const float position[3] = {0, 0, -3}, target[3] = {0, 0, 0};
    forEachTarget([&](const char* target_name) {
        CAPTURE(target_name);
        for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
            for (const uint32_t count : {1u, 15u, 16u, 17u, 1000u})
                checkProjection(raster, lookAt(position, target, 1.2f, 171, 93), randomGaussians(count, count));
    });
}

TEST_CASE("trap 18, trap 19: Gaussians that are not finite are dropped and counted")
{
    const float position[3] = {0, 0, -3}, target[3] = {0, 0, 0};
    const EyeParams eye = lookAt(position, target, 1.2f, 100, 100);
    std::vector<GaussianOf<float>> gaussians = randomGaussians(40, 4);
    for (GaussianOf<float>& g : gaussians)
        for (float& p : g.position)
            p *= 0.1f;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    gaussians[1].scale[0] = kNan;
    gaussians[7].scale[1] = 1e25f;
    gaussians[9].position[2] = kNan;
    gaussians[20].color[1] = kNan;
    gaussians[33].rotation[0] = kNan;
    forEachTarget([&](const char* target_name) {
        CAPTURE(target_name);
        Block block(gaussians);
        std::vector<Splat> splats(40);
        std::vector<uint32_t> depths(40);
        std::vector<uint16_t> origins(40);
        const ProjectCounts counts = projectBlockCpu({&eye, rulesOf(RasterRules::DiffGaussian)}, block.block,
                                                     splats.data(), depths.data(), origins.data());
        CHECK(counts.dropped == 5);
        for (uint32_t i = 0; i < counts.splats; ++i)
            for (const uint16_t bad : {1, 7, 9, 20, 33})
                CHECK(origins[i] != bad);
    });
    uint64_t dropped = 0;
    projectReference<float>(eye, rulesOf(RasterRules::DiffGaussian), gaussians, dropped);
    CHECK(dropped == 5);
}

TEST_CASE("trap 20: what lies at or before the near plane is left out without being counted")
{
    const float position[3] = {0, 0, 0}, target[3] = {0, 0, 1};
    const EyeParams eye = lookAt(position, target, 1.2f, 100, 100);
    std::vector<GaussianOf<float>> gaussians = randomGaussians(3, 9);
    const float depths_in[3] = {0.2f, 0.2000001f, -1};
    for (int i = 0; i < 3; ++i) {
        gaussians[size_t(i)].position[0] = gaussians[size_t(i)].position[1] = 0;
        gaussians[size_t(i)].position[2] = depths_in[i];
        gaussians[size_t(i)].opacity = 1;
    }
    Block block(gaussians);
    Splat splats[3];
    uint32_t depths[3];
    uint16_t origins[3];
    const ProjectCounts counts =
        projectBlockCpu({&eye, rulesOf(RasterRules::DiffGaussian)}, block.block, splats, depths, origins);
    CHECK(counts.splats == 1);
    CHECK(counts.dropped == 0);
    CHECK(origins[0] == 1);
}
