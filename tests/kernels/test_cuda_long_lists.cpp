// SPDX-License-Identifier: Apache-2.0
// Long lists on the device: they give what the ordinary way gives.
#include "tests/kernels/gpu_blend.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

// One way to blend gives the bytes of every other.
template <typename Splat>
void checkSameBytes()
{
    for (const uint32_t bin_height : {16u, 32u}) {
        CAPTURE(bin_height);
        const std::vector<Size> eyes = {{70, 33}, {45, 60}};
        for (const float opacity_max : {0.1f, 1.0f}) { // open to the end, and finished in the middle
            Shapes shapes;
            shapes.opacity_max = opacity_max;
            const auto scene = randomScene<Splat>(eyes, bin_height, RasterRules::DiffGaussian, 1200, 9, shapes);
            const Drawn whole = blendOnDevice(scene);
            checkPixels(scene, whole, kUsualBound<Splat>);
            for (const uint32_t longest : {1u, 3u, 1000u}) {
                CAPTURE(longest);
                CHECK(blendOnDevice(scene, 1, longest) == whole);
                uint32_t known = 0;
                const std::vector<uint16_t> codes = codesOf(scene, known);
                CHECK(blendOnDevice(scene, 1, longest, codes) == whole);
                CHECK(blendOnDevice(scene, 1, longest, codes, false) == whole); // all lists before what is behind them
                CHECK((codes.empty() || known > 40));
            }
            for (const uint32_t passes : {2u, 3u}) {
                CAPTURE(passes);
                CHECK(blendOnDevice(scene, passes) == whole);
                CHECK(blendOnDevice(scene, passes, 2) == whole);
                CHECK(blendOnDevice(scene, passes, 2, {}, false) == whole);
            }
        }
        // many batches of a group, and more units than the longest lists have found at first
        Shapes faint;
        faint.opacity_max = 0.03f;
        faint.sigma_max = 4;
        const auto crowded = randomScene<Splat>({{33, 17}}, bin_height, RasterRules::DiffGaussian, 60000, 4, faint);
        REQUIRE(crowded.lists[0].size() > (kFirstUnits + 1) * kTouchUnit);
        const Drawn ordinary = blendOnDevice(crowded);
        checkPixels(crowded, ordinary, 1e-4);
        CHECK(blendOnDevice(crowded, 1, 1) == ordinary);
        CHECK(blendOnDevice(crowded, 2, 1) == ordinary);
        uint32_t known = 0;
        const std::vector<uint16_t> codes = codesOf(crowded, known);
        CHECK(blendOnDevice(crowded, 1, 1, codes) == ordinary);
        CHECK((codes.empty() || known > 10'000));
    }
}

// The first units of the longest lists leave either, both or none of a pair of sub-tiles unfinished: each goes on, or
// not.
template <typename Splat>
void checkHalves()
{
    Shapes faint;
    faint.opacity_max = 0.02f;
    faint.sigma_max = 3;
    auto scene = randomScene<Splat>({{32, 16}}, 16, RasterRules::DiffGaussian, 95000, 5, faint);
    constexpr uint32_t kOpaque = 60;
    for (uint32_t i = 0; i < kOpaque; ++i) { // in front: of the 8 columns of sub-tiles these finish 0, 2, 3 and 5
        const float places[3][2] = {{1, 1.2f}, {11.5f, 3}, {22, 1.2f}}; // middle, sigma
        const float x = places[i % 3][0], sigma = places[i % 3][1];
        addSplat(scene, 0, {x, 8, sigma * sigma, 0, 1e4f, 1, {0.5f, 0.2f, 0.1f}, {0, 0, 2, 1}});
    }
    for (std::vector<uint32_t>& list : scene.lists)
        std::rotate(list.begin(), list.end() - kOpaque, list.end());
    REQUIRE(scene.lists[0].size() > (kFirstUnits + 1) * kTouchUnit);
    const Drawn ordinary = blendOnDevice(scene), lone = blendOnDevice(scene, 1, 1);
    CHECK(lone == ordinary);
    uint32_t seen = 0; // bit per pair's bits
    for (uint32_t bits = lone.unfinished[0], pair = 0; pair < 8; ++pair, bits >>= 2)
        seen |= 1u << (bits & 3u);
    CHECK(seen == 15);
}

constexpr uint32_t kSegmentKeys = kSegmentUnits * kTouchUnit, kFirstKeys = kFirstUnits * kTouchUnit;

// Bins beside each other, each with a list that is cut into at least three segments; of some sub-tiles light ends in the first
// segment, of others in the second or third, and of others it does not. Most keys miss their bin.
BlendScene<PackedSplat> longLists(uint32_t bin_height, uint32_t bins, uint32_t keys)
{
    Shapes faint;
    faint.opacity_max = 0.05f;
    faint.sigma_max = 3;
    auto scene =
        randomScene<PackedSplat>({{32 * bins, 16}}, bin_height, RasterRules::DiffGaussian, 1500 * bins, 5, faint);
    const std::vector<std::vector<uint32_t>> seen = scene.lists;
    const auto added = [&](float x, float across) {
        addSplat(scene, 0, {x, 8, across, 0, 1e4f, 0.9f, {0.5f, 0.2f, 0.1f}, {0, 0, 2, 1}});
        return uint32_t(scene.splats.size() - 1);
    };
    std::vector<uint32_t> opaque;
    for (uint32_t i = 0; i < 3 * bins; ++i) // over the first three of four columns of pairs
        opaque.push_back(added(4 + 8.0f * float(i % 3) + 32 * float(i / 3), 9));
    const uint32_t outside = added(-500, 2);
    scene.splats[0] = scene.splats[outside]; // one for the first of two passes, and one for the second
    for (uint32_t bin = 0; bin < bins; ++bin) {
        std::vector<uint32_t>& list = scene.lists[bin];
        list.assign(keys + 700 + bin * kTouchUnit, outside);
        std::fill_n(list.begin(), list.size() / 2, 0u);
        for (size_t i = 0; i < seen[bin].size(); ++i)
            list[list.size() * i / seen[bin].size()] = seen[bin][i];
        for (uint32_t i = 0; i < 3; ++i)
            for (uint32_t layer = 0; layer < 24; ++layer)
                list[kFirstKeys + kSegmentKeys * i + 97 * layer + 13] = opaque[3 * bin + i];
    }
    return scene;
}

double worstDifference(const Drawn& a, const Drawn& b)
{
    double worst = 0;
    for (size_t i = 0; i < a.images[0].size(); ++i)
        worst = std::max(worst, std::abs(double(a.images[0][i]) - b.images[0][i]));
    return worst;
}

void checkSegments(uint32_t bin_height)
{
    const BlendScene<PackedSplat> one = longLists(bin_height, 1, kFirstKeys + 3 * kSegmentKeys);
    const Drawn cut = blendOnDevice(one, 1, 1);
    CHECK(worstDifference(cut, blendOnDevice(one)) <= 2e-6);
    uint32_t apart = 0, again = 0; // whether segments are blended in turn or apart is chance
    for (uint32_t run = 0; run < 12; ++run) {
        const Drawn repeated = blendOnDevice(one, 1, 1);
        CHECK(repeated.images[0] == cut.images[0]);
        CHECK(repeated.counters.pass.segment_pairs == 8);
        for (uint32_t i = 0; i < repeated.counters.pass.segments_pushed; ++i)
            ++((repeated.segment_queue[i] - 1) >> 31 == 0 ? apart : again);
    }
    CHECK(apart > 0);
    CHECK(again > 0);
}

// More pairs than warps, so that most segments are blended in turn; the first list by itself, when other warps wait.
void checkManySegments(uint32_t bin_height)
{
    constexpr uint32_t kBins = 8;
    const BlendScene<PackedSplat> many = longLists(bin_height, kBins, kFirstKeys + 3 * kSegmentKeys);
    REQUIRE(many.lists.size() == kBins);
    const Drawn all = blendOnDevice(many, 1, kBins), fullest = blendOnDevice(many, 1, 1);
    CHECK(all.counters.pass.segment_pairs == 8 * kBins);
    CHECK(fullest.counters.pass.segment_pairs == 8);
    CHECK(worstDifference(all, blendOnDevice(many)) <= 2e-6);
    uint32_t different = 0;
    for (uint32_t y = 0; y < 16; ++y)
        for (uint32_t i = 3 * 32 * (kBins - 1); i < 3 * 32 * kBins; ++i) // the last has the longest list
            different +=
                floatBits(all.images[0][y * 96 * kBins + i]) != floatBits(fullest.images[0][y * 96 * kBins + i]);
    CHECK(different == 0);
}

void checkSegmentsOfPasses()
{
    const BlendScene<PackedSplat> scene = longLists(16, 1, 2 * (kFirstKeys + 2 * kSegmentKeys));
    const Drawn cut = blendOnDevice(scene, 2, 1);
    CHECK(cut.counters.pass.segment_pairs > 0); // pairs of the second pass
    CHECK(worstDifference(cut, blendOnDevice(scene, 2)) <= 2e-6);
}

} // namespace

TEST_CASE("blend: a warp goes on with the sub-tiles of a long list that take light, be it either, both or none")
{
    checkHalves<PackedSplat>();
    checkHalves<ExactSplat>();
}

TEST_CASE("blend fast: segments of a list join to what it is as a whole, and light ends in the right one")
{
    for (const uint32_t bin_height : {16u, 32u}) {
        checkSegments(bin_height);
        checkManySegments(bin_height);
    }
    checkSegmentsOfPasses();
}

TEST_CASE("blend fast: long lists and passes give the bytes of the ordinary way; two eyes of their own sizes")
{
    checkSameBytes<PackedSplat>();
}

TEST_CASE("blend exact: long lists and passes give the bytes of the ordinary way; two eyes of their own sizes")
{
    checkSameBytes<ExactSplat>();
}

TEST_CASE("blend: depths read no more of a list than was found because its light went on")
{
    for (const uint32_t bin_height : {16u, 32u}) {
        auto scene = emptyScene<PackedSplat>({{32, 16}}, bin_height, RasterRules::DiffGaussian);
        Ellipse e{16, -80, 2, 0, 2, 1, {1, 0, 0}, {0, 0, 2, 1}};
        for (uint32_t i = 0; i < kFirstUnits * kTouchUnit + 9; ++i) {
            const bool covers = i / 4 == kFirstUnits * kTouchUnit / 4 - 2; // four of them: all light ends there
            e.y = covers ? 8.0f : -80.0f;
            e.a = e.c = covers ? 1e6f : 2.0f;
            addSplat(scene, 0, e);
        }
        REQUIRE(scene.lists[0].size() > kFirstUnits * kTouchUnit);
        const Drawn whole = blendOnDevice(scene);
        CHECK(blendOnDevice(scene, 1, 1) == whole);
        CHECK(whole.images[0][0] > 0.98f);
    }
}
