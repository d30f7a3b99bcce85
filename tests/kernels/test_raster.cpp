// SPDX-License-Identifier: Apache-2.0
// Sorting, binning and blending of splats made by hand, against the scalar reference.
#include "kernels/blend/blend.h"
#include "kernels/threads/parallel.h"
#include "tests/kernels/render_tools.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <bit>
#include <cstring>
#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

// Splats in the form of both paths. Boxes are upstream's tiles: nothing is culled by the ellipse but in binCpu.
struct BlendCase {
    std::vector<SplatOf<float>> reference;
    std::vector<Splat> fast;
    std::vector<SortKey> keys;
    uint32_t width, height;

    void add(float x, float y, float a, float b, float c, float opacity, const float* color, float depth)
    {
        SplatOf<float> s{};
        EyeParams eye{};
        eye.width = width;
        eye.height = height;
        const float det = a * c - b * b;
        s.x = x;
        s.y = y;
        s.conic[0] = c / det;
        s.conic[1] = -b / det;
        s.conic[2] = a / det;
        s.opacity = opacity;
        std::copy_n(color, 3, s.color);
        s.depth = depth;
        s.order = reference.size();
        s.tiles = tileRect<float>(eye, false, x, y, splatRadius<float>({a, b, c}, det, 0.1f));
        if (s.tiles.empty())
            return;
        const float condition = a * c / det;
        Splat f{x, y, {s.conic[0], s.conic[1], s.conic[2]}, opacity, {color[0], color[1], color[2]}, 0, 0, 0, 0, 0};
        f.cutoff = det > 0 ? std::log(255 * opacity) * (1 + 4e-6f * condition) + 1e-3f : kLooseCutoff;
        f.x0 = uint16_t(s.tiles.x0 * 16);
        f.y0 = uint16_t(s.tiles.y0 * 16);
        f.x1 = uint16_t(std::min<int32_t>(s.tiles.x1 * 16, int32_t(width)) - 1);
        f.y1 = uint16_t(std::min<int32_t>(s.tiles.y1 * 16, int32_t(height)) - 1);
        reference.push_back(s);
        fast.push_back(f);
    }

    void order()
    {
        for (const uint32_t i : sortReference(reference))
            keys.push_back({0, i});
    }
};

BlendCase randomScene(uint32_t width, uint32_t height, uint32_t count, uint32_t seed, float opacity_min)
{
    Random random(seed);
    BlendCase scene;
    scene.width = width;
    scene.height = height;
    for (uint32_t i = 0; i < count; ++i) {
        const float sigma1 = std::exp(random.uniform(-0.6f, 3)),
                    sigma2 = std::exp(random.uniform(-0.6f, i % 5 ? 2 : 4));
        const float angle = random.uniform(0, 3.14f), ca = std::cos(angle), sa = std::sin(angle);
        const float v1 = sigma1 * sigma1, v2 = sigma2 * sigma2;
        const float color[3] = {random.uniform(), random.uniform(), random.uniform()};
        scene.add(random.uniform(-20, float(width) + 20), random.uniform(-20, float(height) + 20),
                  v1 * ca * ca + v2 * sa * sa, (v1 - v2) * ca * sa, v1 * sa * sa + v2 * ca * ca,
                  random.uniform(opacity_min, 1), color, random.uniform(1, 5));
    }
    scene.order();
    return scene;
}

std::vector<float> blendFast(const BlendCase& scene, const RasterConstants& rules, const float* background, int threads,
                             uint64_t& pairs)
{
    const Workers workers(threads);
    BinScratch bins;
    const uint32_t grid_x = tileCount(scene.width), grid_y = tileCount(scene.height);
    pairs = binCpu({scene.fast.data(), scene.keys.data(), scene.keys.size(), grid_x, grid_y}, workers, bins);
    const size_t canary = 64;
    std::vector<float> image(size_t(3) * scene.width * scene.height + canary, -5.0f);
    BlendArgs args{bins.splats.data(),
                   bins.tile_first.data(),
                   bins.entries.data(),
                   grid_x,
                   grid_y,
                   scene.width,
                   scene.height,
                   rules,
                   {background[0], background[1], background[2]},
                   image.data()};
    blendCpu(args, workers);
    for (size_t i = image.size() - canary; i < image.size(); ++i)
        CHECK(image[i] == -5.0f);
    image.resize(image.size() - canary);
    return image;
}

// BlendArgs::squares of every entry of `bins`.
std::vector<float> squaresFast(const BlendCase& scene, const BinScratch& bins, uint64_t pairs,
                               const RasterConstants& rules, int threads)
{
    std::vector<float> squares(pairs, -5.0f);
    BlendArgs args{bins.splats.data(),
                   bins.tile_first.data(),
                   bins.entries.data(),
                   tileCount(scene.width),
                   tileCount(scene.height),
                   scene.width,
                   scene.height,
                   rules};
    args.squares = squares.data();
    blendCpu(args, Workers(threads));
    return squares;
}

std::vector<float> squaresScalar(const BlendCase& scene, const BinScratch& bins, uint64_t pairs,
                                 const RasterConstants& rules)
{
    std::vector<float> squares(pairs);
    const float white[3] = {1, 1, 1};
    for (uint32_t y = 0; y < scene.height; ++y)
        for (uint32_t x = 0; x < scene.width; ++x) {
            const uint32_t tile = y / kTileSize * tileCount(scene.width) + x / kTileSize;
            PixelState<float> pixel{{0, 0, 0}, 1, false};
            for (uint32_t i = bins.tile_first[tile]; i < bins.tile_first[tile + 1] && !pixel.done; ++i) {
                const Splat& s = bins.splats[bins.entries[i]];
                pixel.color[0] = 0; // then the colour is the weight
                blendStep(rules, s.conic, s.x - float(x), s.y - float(y), s.opacity, white, pixel);
                squares[i] += pixel.color[0] * pixel.color[0];
            }
        }
    return squares;
}

std::vector<float> blendScalar(const BlendCase& scene, const RasterConstants& rules, const float* background,
                               uint64_t& pairs)
{
    std::vector<uint32_t> sorted;
    for (const SortKey& key : scene.keys)
        sorted.push_back(key.slot);
    const TileLists lists = binReference(scene.reference, sorted, tileCount(scene.width), tileCount(scene.height));
    pairs = lists.entries.size();
    std::vector<float> image(size_t(3) * scene.width * scene.height);
    blendReference(scene.reference, lists, scene.width, scene.height, rules, background, image.data());
    return image;
}

} // namespace

TEST_CASE("image sizes round the edges of tiles, sparse and saturated, both rasterisers: blend matches the scalar")
{
    const float background[3] = {0.25f, 0.5f, 1};
    for (const auto& size : {std::pair<uint32_t, uint32_t>{1, 1}, {15, 17}, {16, 16}, {33, 31}, {100, 64}, {131, 77}})
        for (const uint32_t count : {1u, 60u, 1500u})
            for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
                const uint32_t width = size.first, height = size.second;
                const BlendCase scene = randomScene(width, height, count, width + count, count > 1000 ? 0.5f : 0.005f);
                uint64_t pairs_scalar, pairs;
                const std::vector<float> expected = blendScalar(scene, rulesOf(raster), background, pairs_scalar);
                forEachTarget([&](const char* target) {
                    CAPTURE(target);
                    CAPTURE(width);
                    CAPTURE(count);
                    const Difference d = compare(blendFast(scene, rulesOf(raster), background, 1, pairs), expected);
                    CHECK(d.psnr > 95);
                    CHECK(d.above <= 1 + expected.size() / 10000);
                    CHECK(pairs <= pairs_scalar);
                    CHECK(compare(blendFast(scene, rulesOf(raster), background, 3, pairs),
                                  blendFast(scene, rulesOf(raster), background, 1, pairs))
                              .worst == 0);
                });
            }
}

TEST_CASE("squares of weights are those of the scalar step for every pair of tile and splat, on any number of threads")
{
    for (const auto& [width, height] : {std::pair<uint32_t, uint32_t>{33, 31}, {131, 77}})
        for (const uint32_t count : {60u, 1500u})
            for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
                const BlendCase scene = randomScene(width, height, count, width + count, count > 1000 ? 0.5f : 0.005f);
                BinScratch bins;
                const uint64_t pairs = binCpu(
                    {scene.fast.data(), scene.keys.data(), scene.keys.size(), tileCount(width), tileCount(height)},
                    Workers(1), bins);
                const std::vector<float> expected = squaresScalar(scene, bins, pairs, rulesOf(raster));
                forEachTarget([&](const char* target) {
                    CAPTURE(target);
                    CAPTURE(count);
                    const std::vector<float> squares = squaresFast(scene, bins, pairs, rulesOf(raster), 1);
                    size_t off = 0; // a pixel may take or leave what is at 1/255 or at the bound
                    for (size_t i = 0; i < pairs; ++i)
                        off += !(std::fabs(squares[i] - expected[i]) <= 1e-3f * expected[i]);
                    CHECK(off <= 1 + pairs / 1000);
                    CHECK(std::reduce(squares.begin(), squares.end(), 0.0) ==
                          doctest::Approx(std::reduce(expected.begin(), expected.end(), 0.0)).epsilon(1e-5));
                    CHECK(squares == squaresFast(scene, bins, pairs, rulesOf(raster), 3));
                });
            }
}

TEST_CASE("trap 21: splats whose determinant is negative are drawn where their power is, among others")
{
    const float background[3] = {0.25f, 0.5f, 1};
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        Random random(21);
        BlendCase scene;
        scene.width = 70;
        scene.height = 40;
        for (uint32_t i = 0; i < 120; ++i) {
            const float color[3] = {random.uniform(), random.uniform(), random.uniform()};
            const float a = random.uniform(4, 40), c = random.uniform(4, 40), b = std::sqrt(a * c);
            scene.add(random.uniform(0, 70), random.uniform(0, 40), a, i % 4 == 0 ? 1.1f * b : 0.5f * b, c,
                      random.uniform(0.02f, 0.6f), color, random.uniform(1, 5));
        }
        scene.order();
        uint64_t pairs;
        const std::vector<float> expected = blendScalar(scene, rulesOf(raster), background, pairs);
        forEachTarget([&](const char* target) {
            CAPTURE(target);
            const Difference d = compare(blendFast(scene, rulesOf(raster), background, 1, pairs), expected);
            CHECK(d.psnr > 95);
            CHECK(d.above <= 1 + expected.size() / 10000);
        });
    }
}

TEST_CASE("an opacity of 1/255 is drawn where nothing falls off, and the next smaller one is not")
{
    const float background[3] = {0, 0, 0}, white[3] = {1, 1, 1};
    for (const bool drawn : {true, false}) {
        CAPTURE(drawn);
        BlendCase scene;
        scene.width = scene.height = 33;
        scene.add(16, 16, 4, 0, 4, drawn ? kOpacityFloor : std::nextafter(kOpacityFloor, 0.0f), white, 2);
        scene.order();
        uint64_t pairs;
        forEachTarget([&](const char* target) {
            CAPTURE(target);
            const std::vector<float> image = blendFast(scene, rulesOf(RasterRules::DiffGaussian), background, 1, pairs);
            CHECK((image[(16 * 33 + 16) * 3] > 0) == drawn);
        });
    }
}

TEST_CASE("trap 28: a run of equal depths longer than a chunk of keys is in source order too")
{
    const SyntheticModel model({.anchors = 400, .feat_dim = 4, .n_offsets = 1});
    const ModelView& view = model.view();
    const uint32_t blocks = 900;
    std::vector<VisibleAnchor> visible;
    while (visible.size() < size_t(blocks) * kDecodeBlock)
        for (uint32_t c = 0; c < view.params->chunk_count; ++c)
            for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i)
                visible.push_back({c, i, 1, {1, 1}});
    std::vector<uint32_t> depths(size_t(blocks) * kDecodeBlock, 0x40000000u), counts(blocks, kDecodeBlock);
    for (size_t i = 0; i < 1000; ++i)
        depths[7 * i] = 0x3f800000u;
    std::vector<uint16_t> origins(depths.size());
    for (size_t i = 0; i < origins.size(); ++i)
        origins[i] = uint16_t(i % kDecodeBlock);
    SortScratch scratch;
    const Workers three(3);
    REQUIRE(sortCpu({&view, visible.data(), depths.data(), origins.data(), counts.data(), blocks, kDecodeBlock}, three,
                    scratch) == depths.size());
    bool ordered = true;
    const auto order = [&](size_t i) {
        const VisibleAnchor& anchor = visible[scratch.keys[0][i].slot];
        return emissionOrder(view, anchor.chunk, anchor.local, 0);
    };
    for (size_t i = 1; i < depths.size(); ++i)
        ordered &= i == 1000 || order(i - 1) <= order(i);
    CHECK(ordered);
    CHECK(scratch.keys[0][999].depth_bits < scratch.keys[0][1000].depth_bits);
}

TEST_CASE("tile lists leave out only tiles the 1/255 ellipse misses, and some of those")
{
    const BlendCase scene = randomScene(320, 240, 800, 77, 0.005f);
    const Workers one(1);
    BinScratch bins;
    const uint64_t pairs = binCpu({scene.fast.data(), scene.keys.data(), scene.keys.size(), 20, 15}, one, bins);
    uint64_t upstream = 0;
    size_t missing = 0;
    for (uint32_t i = 0; i < scene.keys.size(); ++i) {
        const SplatOf<float>& s = scene.reference[scene.keys[i].slot];
        for (int32_t ty = s.tiles.y0; ty < s.tiles.y1; ++ty)
            for (int32_t tx = s.tiles.x0; tx < s.tiles.x1; ++tx) {
                ++upstream;
                bool drawn = false;
                for (int32_t y = ty * 16; y < ty * 16 + 16; ++y)
                    for (int32_t x = tx * 16; x < tx * 16 + 16; ++x) {
                        const float power = gaussianPower(s.conic, s.x - float(x), s.y - float(y));
                        drawn |= power <= 0 && s.opacity * std::exp(power) >= kOpacityFloor;
                    }
                const uint32_t tile = uint32_t(ty) * 20 + uint32_t(tx);
                const uint32_t* first = bins.entries.data() + bins.tile_first[tile];
                const uint32_t* last = bins.entries.data() + bins.tile_first[tile + 1];
                missing += drawn && std::find(first, last, i) == last;
                CHECK(std::is_sorted(first, last));
            }
    }
    CHECK(missing == 0);
    CHECK(pairs < upstream * 8 / 10);
}

TEST_CASE("trap 26: beyond 3 sigma a splat is drawn inside its tiles and cut at their edge")
{
    BlendCase scene;
    scene.width = scene.height = 64;
    const float white[3] = {1, 1, 1}, black[3] = {0, 0, 0};
    // sigma 2.3: r = 7, so the square ends at 31.4, inside tile 1; 1/255 is reached at 3.33 sigma = 7.66
    scene.add(24.4f, 24.4f, 5.29f, 0, 5.29f, 1, white, 1);
    scene.order();
    CHECK(scene.reference[0].tiles.x0 == 1);
    CHECK(scene.reference[0].tiles.x1 == 2);
    uint64_t pairs;
    const std::vector<float> image = blendFast(scene, rulesOf(RasterRules::DiffGaussian), black, 1, pairs);
    const auto pixel = [&image](int x, int y) { return image[size_t(3) * (size_t(y) * 64 + size_t(x))]; };
    const auto alpha = [](float dx, float dy) { return std::exp(-0.5f * (dx * dx + dy * dy) / 5.29f); };
    CHECK(pixel(31, 24) == doctest::Approx(alpha(6.6f, 0.4f)).epsilon(1e-4));
    CHECK(pixel(17, 24) == doctest::Approx(alpha(7.4f, 0.4f)).epsilon(1e-4)); // 3.2 sigma
    CHECK(pixel(16, 24) == 0.0f);                                             // below 1/255
    CHECK(alpha(7.6f, 0.4f) > kOpacityFloor);
    CHECK(pixel(32, 24) == 0.0f); // the next tile
}

TEST_CASE("trap 28: equal depths are drawn in the order of the source, wherever the anchors lie in the file")
{
    const SyntheticModel model({.anchors = 64, .n_offsets = 4});
    const ModelView& view = model.view();
    std::vector<VisibleAnchor> visible;
    for (uint32_t c = 0; c < view.params->chunk_count; ++c)
        for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i)
            visible.push_back({c, i, 1, {1, 1}});
    const uint32_t capacity = kDecodeBlock * 4;
    std::vector<uint32_t> depths;
    std::vector<uint16_t> origins;
    Random random(3);
    for (uint32_t i = 0; i < 256; ++i) {
        const float depth = 1 + float(int(random.uniform() * 8)); // many ties
        uint32_t bits;
        std::memcpy(&bits, &depth, 4);
        depths.push_back(bits);
        origins.push_back(uint16_t((i * 101) % 256));
    }
    // the last keys are a run of two, which stand the wrong way round
    const auto order_of = [&](uint32_t slot) {
        const VisibleAnchor& anchor = visible[origins[slot] / 4];
        return emissionOrder(view, anchor.chunk, anchor.local, origins[slot] % 4);
    };
    uint32_t earlier = 1;
    while (earlier < 255 && order_of(earlier) > order_of(0))
        ++earlier;
    depths[0] = depths[earlier] = std::bit_cast<uint32_t>(9.0f);
    const uint32_t counts[1] = {256};
    for (const int threads : {1, 2}) {
        SortScratch scratch;
        const Workers workers(threads);
        REQUIRE(sortCpu({&view, visible.data(), depths.data(), origins.data(), counts, 1, capacity}, workers,
                        scratch) == 256);
        bool ordered = true;
        std::vector<bool> seen(256);
        uint64_t last_order = 0;
        for (size_t i = 0; i < 256; ++i) {
            const SortKey& key = scratch.keys[0][i];
            seen[key.slot] = true;
            const uint64_t order = order_of(key.slot);
            if (i > 0) {
                const uint32_t before = scratch.keys[0][i - 1].depth_bits;
                ordered &= before < key.depth_bits || (before == key.depth_bits && last_order < order);
            }
            last_order = order;
        }
        CHECK(ordered);
        CHECK(std::find(seen.begin(), seen.end(), false) == seen.end());
    }
}

TEST_CASE("trap 28: over several chunks of keys, in blocks of visible anchors or of groups, on any number of threads")
{
    SyntheticOptions options{.anchors = 3000, .feat_dim = 4, .n_offsets = 20};
    const SyntheticModel model(options);
    const ModelView& view = model.view();
    std::vector<VisibleAnchor> visible;
    std::vector<uint32_t> groups;
    for (uint32_t c = 0; c < view.params->chunk_count; ++c)
        for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i)
            visible.push_back({c, i, 1, {1, 1}});
    for (uint32_t g = 0; g < view.params->group_count; ++g)
        groups.push_back(g);
    const uint32_t capacity = kDecodeBlock * options.n_offsets;
    for (const bool by_group : {false, true}) {
        const size_t blocks = by_group ? groups.size() : (visible.size() + kDecodeBlock - 1) / kDecodeBlock;
        std::vector<uint32_t> depths(blocks * capacity), counts(blocks);
        std::vector<uint16_t> origins(depths.size());
        std::vector<uint64_t> orders(depths.size()); // order of emission
        Random random(4);
        size_t anchor = 0; // groups lie in the file one after the other
        for (size_t b = 0; b < blocks; ++b) {
            const size_t last = by_group ? anchor + view.groups[b].anchor_count : anchor + kDecodeBlock;
            for (uint32_t origin = 0; anchor < std::min(last, visible.size()); ++anchor)
                for (uint32_t k = 0; k < options.n_offsets; ++k, ++origin) {
                    if (random.uniform() < 0.2f)
                        continue;
                    const float depth = 1 + float(int(random.uniform() * 8));
                    const size_t slot = b * capacity + counts[b]++;
                    std::memcpy(&depths[slot], &depth, 4);
                    origins[slot] = uint16_t(origin);
                    orders[slot] = emissionOrder(view, visible[anchor].chunk, visible[anchor].local, k);
                }
        }
        for (const int threads : {1, 2, 5}) {
            SortScratch scratch;
            const Workers workers(threads);
            const size_t count = sortCpu({&view, visible.data(), depths.data(), origins.data(), counts.data(),
                                          uint32_t(blocks), capacity, by_group ? groups.data() : nullptr},
                                         workers, scratch);
            REQUIRE(count > 40000);
            size_t wrong = 0;
            for (size_t i = 1; i < count; ++i) {
                const SortKey &a = scratch.keys[0][i - 1], &b = scratch.keys[0][i];
                wrong +=
                    a.depth_bits > b.depth_bits || (a.depth_bits == b.depth_bits && orders[a.slot] >= orders[b.slot]);
            }
            CHECK(wrong == 0);
        }
    }
}

TEST_CASE("sorting orders any depths, over several blocks and chunks of keys")
{
    const SyntheticModel model({.anchors = 1, .n_offsets = 1});
    const uint32_t blocks = 1000, capacity = kDecodeBlock;
    std::vector<VisibleAnchor> visible(size_t(blocks) * kDecodeBlock, VisibleAnchor{0, 0, 1, {1, 1}});
    std::vector<uint32_t> depths(size_t(blocks) * capacity), counts(blocks);
    std::vector<uint16_t> origins(depths.size());
    Random random(8);
    uint64_t total = 0;
    for (uint32_t b = 0; b < blocks; ++b) {
        counts[b] = uint32_t(random.uniform() * (kDecodeBlock + 1));
        total += counts[b];
        for (uint32_t i = 0; i < counts[b]; ++i) {
            const float depth = std::exp(random.uniform(-1, 9));
            std::memcpy(&depths[size_t(b) * capacity + i], &depth, 4);
        }
    }
    SortScratch scratch;
    const Workers two(2);
    REQUIRE(sortCpu({&model.view(), visible.data(), depths.data(), origins.data(), counts.data(), blocks, capacity},
                    two, scratch) == total);
    bool ordered = true;
    for (size_t i = 1; i < total; ++i)
        ordered &= scratch.keys[0][i - 1].depth_bits <= scratch.keys[0][i].depth_bits;
    CHECK(ordered);
}
