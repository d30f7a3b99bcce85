// SPDX-License-Identifier: Apache-2.0
// Sorted splats to pixels on the device, against a loop over every splat of a bin for every pixel.
#include "kernels/blend/blend_cuda.h"
#include "tests/kernels/blend_scene.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Drawn {
    std::vector<float> images[kMaxEyes], depths[kMaxEyes];
    FrameCounters counters;
    std::vector<uint32_t> unfinished; // of the last pass: BlendCudaArgs

    bool operator==(const Drawn& other) const // bytes, not values
    {
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            if (images[e].size() != other.images[e].size())
                return false;
            for (size_t i = 0; i < images[e].size(); ++i)
                if (floatBits(images[e][i]) != floatBits(other.images[e][i]))
                    return false;
            if (depths[e] != other.depths[e])
                return false;
        }
        return true;
    }
};

void launch(const BlendCudaArgs& args, const PackedSplat*)
{
    blendFastCuda(args, kTestProcessors, testStream().handle);
}
void launch(const BlendCudaArgs& args, const ExactSplat*)
{
    blendExactCuda(args, kTestProcessors, testStream().handle);
}

// Codes of most of the small splats, of others that there is none; of what has no codes, nothing.
std::vector<uint16_t> codesOf(const BlendScene<PackedSplat>& scene, uint32_t& known)
{
    std::vector<uint16_t> codes;
    for (const PackedSplat& s : scene.splats) {
        const Spread spread = spreadOf(s, scene.rules);
        const double reach = 2 * std::log(255 * stepsFloat(s.opacity)) + 5e-3;
        const double ex = std::sqrt(reach * spread.xx) + 0.01, ey = std::sqrt(reach * spread.yy) + 0.01;
        const double square = std::ceil(spread.radius - 1e-3);
        const double x0 = std::ceil(s.x - ex), y0 = std::ceil(s.y - ey), x1 = std::floor(s.x + ex),
                     y1 = std::floor(s.y + ey);
        const bool coded = codes.size() % 5 != 0 && reach > 0 &&
                           std::max(ex, ey) <= std::min<double>(kTouchReach, square - 1) && x0 >= 0 && y0 >= 0 &&
                           x0 <= x1 && y0 <= y1;
        known += coded;
        codes.push_back(uint16_t(coded ? touchCode(uint32_t(x0) / 4, uint32_t(x1) / 4 - uint32_t(x0) / 4, uint32_t(y0),
                                                   uint32_t(y1) - uint32_t(y0))
                                       : kTouchUnknown));
    }
    return codes;
}
std::vector<uint16_t> codesOf(const BlendScene<ExactSplat>&, uint32_t&)
{
    return {};
}

// Draws the scene in `passes`, each of which takes its part of the splats; the `longest` fullest bins as long lists. codes:
// touchCode() of each splat, or none.
template <typename Splat>
Drawn blendOnDevice(const BlendScene<Splat>& scene, uint32_t passes = 1, uint32_t longest = 0,
                    const std::vector<uint16_t>& codes = {})
{
    const auto eye_count = uint32_t(scene.eyes.size());
    const uint32_t bins = eye_count * scene.grid.bins();
    const auto pixels = [&](uint32_t e) {
        return e < eye_count ? size_t(scene.eyes[e].width) * scene.eyes[e].height : size_t(0);
    };
    const GuardedBuffer<Splat> splats(scene.splats);
    const GuardedBuffer<uint16_t> touches(codes);
    const GuardedBuffer<float> image[kMaxEyes] = {GuardedBuffer<float>(3 * pixels(0)),
                                                  GuardedBuffer<float>(3 * pixels(1))};
    const GuardedBuffer<float> depth[kMaxEyes] = {GuardedBuffer<float>(pixels(0)), GuardedBuffer<float>(pixels(1))};
    std::vector<SplatPlace> splat_places(scene.splats.size());
    for (size_t i = 0; i < splat_places.size(); ++i)
        splat_places[i] = {floatBits(float(i + 1)), 0}; // so that a depth tells the splat
    const GuardedBuffer<SplatPlace> places(splat_places);
    const GuardedBuffer<float> left[kMaxEyes] = {GuardedBuffer<float>(pixels(0)), GuardedBuffer<float>(pixels(1))};
    FrameCounters before{};
    before.any_positive[0] = before.any_positive[1] = scene.any_positive;
    Drawn drawn{};
    drawn.counters = before;
    for (uint32_t pass = 0; pass < passes; ++pass) {
        const auto first = uint32_t(scene.splats.size() * pass / passes);
        const auto last = uint32_t(scene.splats.size() * (pass + 1) / passes);
        std::vector<BinKey> keys;
        std::vector<uint32_t> ends, queue(bins), counts(bins);
        for (uint32_t bin = 0; bin < bins; ++bin) {
            const size_t begin = keys.size();
            for (const uint32_t i : scene.lists[bin])
                if (i >= first && i < last)
                    keys.push_back({~0u, i});
            for (uint32_t slab = 1; slab <= scene.grid.slabs(); ++slab)
                ends.push_back(uint32_t(begin + (keys.size() - begin) * slab / scene.grid.slabs()));
            counts[bin] = uint32_t(keys.size() - begin);
            queue[bin] = bin;
        }
        std::stable_sort(queue.begin(), queue.end(), [&](uint32_t a, uint32_t b) { return counts[a] > counts[b]; });
        std::vector<TouchUnit> units;
        std::vector<uint32_t> unit_of(bins, ~0u);
        uint32_t long_bins = std::min(longest, bins);
        while (long_bins > 0 && counts[queue[long_bins - 1]] == 0) // no empty list is long
            --long_bins;
        for (uint32_t i = 0; i < long_bins; ++i) {
            const uint32_t entry = queue[i], start = entry == 0 ? 0u : ends[entry * scene.grid.slabs() - 1];
            unit_of[entry] = uint32_t(units.size());
            for (uint32_t at = 0; at < counts[entry]; at += kTouchUnit)
                units.push_back({entry, entry / scene.grid.bins(), at / kTouchUnit, start + at,
                                 std::min(kTouchUnit, counts[entry] - at)});
        }
        FrameCounters counters = drawn.counters;
        counters.pass = {};
        counters.pass.bins = uint32_t(queue.size());
        counters.pass.long_bins = long_bins;
        while (
            counters.pass.longest_bins < counters.pass.long_bins &&
            (counters.pass.longest_bins == 0 || counts[queue[counters.pass.longest_bins]] > kFirstUnits * kTouchUnit))
            ++counters.pass.longest_bins;
        counters.pass.touch_units = uint32_t(units.size());
        const GuardedBuffer<TouchUnit> device_units(units);
        const GuardedBuffer<uint32_t> bin_units(unit_of), touch(units.size() * touchWords(scene.grid)),
            unfinished(std::vector<uint32_t>(bins, 0u));
        const GuardedBuffer<BinKey> device_keys(keys);
        const GuardedBuffer<uint32_t> cells(ends), bin_queue(queue);
        const GuardedBuffer<FrameCounters> device_counters(std::vector<FrameCounters>{counters});
        BlendCudaArgs args{};
        args.grid = scene.grid;
        args.eye_count = eye_count;
        args.pass = {nullptr, pass, passes};
        for (uint32_t e = 0; e < eye_count; ++e) {
            args.width[e] = scene.eyes[e].width;
            args.height[e] = scene.eyes[e].height;
            args.image[e] = image[e].get();
            args.depth[e] = depth[e].get();
            args.transmittance[e] = left[e].get();
        }
        args.rules = scene.rules;
        std::copy_n(scene.background, 3, args.background);
        args.empty_is_black = scene.empty_is_black;
        args.splats = splats.get();
        args.touches = codes.empty() ? nullptr : touches.get();
        args.places = places.get();
        args.cells = cells.get();
        args.bin_queue = bin_queue.get();
        args.bin_units = bin_units.get();
        args.touch_units = device_units.get();
        args.touch = touch.get();
        args.unfinished = unfinished.get();
        args.keys = device_keys.get();
        args.pair_capacity = uint32_t(keys.size());
        args.counters = device_counters.get();
        launch(args, static_cast<const Splat*>(nullptr));
        for (const bool whole :
             {splats.intact(), image[0].intact(), image[1].intact(), left[0].intact(), left[1].intact(),
              depth[0].intact(), depth[1].intact(), device_keys.intact(), cells.intact(), bin_queue.intact(),
              device_counters.intact(), device_units.intact(), bin_units.intact(), touch.intact(), unfinished.intact()})
            CHECK(whole);
        drawn.counters = device_counters.read()[0];
        drawn.unfinished = unfinished.read();
    }
    for (uint32_t e = 0; e < eye_count; ++e) {
        drawn.images[e] = image[e].read();
        drawn.depths[e] = depth[e].read();
    }
    return drawn;
}

// Every pixel within what rounding explains, and for almost all of them that is little.
template <typename Splat>
void checkPixels(const BlendScene<Splat>& scene, const Drawn& drawn, double usual_bound)
{
    size_t total = 0, wrong = 0, doubtful = 0, wrong_depths = 0, doubtful_depths = 0;
    double worst = 0;
    for (uint32_t e = 0; e < scene.eyes.size(); ++e)
        for (uint32_t y = 0; y < scene.eyes[e].height; ++y)
            for (uint32_t x = 0; x < scene.eyes[e].width; ++x) {
                const uint32_t bin = y / scene.grid.height * scene.grid.columns + x / kBinWidth;
                const Pixel pixel = referencePixel(scene, scene.lists[e * scene.grid.bins() + bin], x, y);
                const float* found = drawn.images[e].data() + (size_t(y) * scene.eyes[e].width + x) * 3;
                double error = 0;
                for (int c = 0; c < 3; ++c)
                    error =
                        found[c] == found[c] ? std::max(error, std::abs(double(found[c]) - pixel.color[c])) : INFINITY;
                wrong += !(error <= pixel.bound);
                doubtful += pixel.bound > usual_bound;
                if (pixel.bound <= usual_bound)
                    worst = std::max(worst, error);
                ++total;
                const float depth = drawn.depths[e][size_t(y) * scene.eyes[e].width + x];
                wrong_depths += !pixel.depth_doubtful && depth != pixel.depth;
                doubtful_depths += pixel.depth_doubtful;
            }
    if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
        MESSAGE(total, " pixels, ", doubtful, " of them in doubt, worst of the others ", worst);
    CHECK(wrong == 0);
    CHECK(doubtful <= 1 + total / 20);
    CHECK(wrong_depths == 0);
    CHECK(doubtful_depths <= 1 + total / 20);
}

// The tier `fast` rounds every exponent by 1e-5 at most (blend_scene.cpp), and the bound assumes that all these errors have the same sign.
template <typename Splat>
constexpr double kUsualBound = std::is_same_v<Splat, PackedSplat> ? 6e-5 : 3e-5;

const std::vector<Size> kSizes = {{1, 1}, {31, 15}, {32, 16}, {33, 17}, {100, 70}};

template <typename Splat>
void checkSizes()
{
    for (const uint32_t bin_height : {16u, 32u})
        for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
            for (const Size& size : kSizes)
                for (const uint32_t count : {1u, 127u, 129u, 600u}) {
                    CAPTURE(bin_height);
                    CAPTURE(uint32_t(raster));
                    CAPTURE(size.width);
                    CAPTURE(count);
                    Shapes shapes;
                    shapes.hollow = std::is_same_v<Splat, ExactSplat>;
                    const auto scene =
                        randomScene<Splat>({size}, bin_height, raster, count, count + size.width, shapes);
                    const Drawn drawn = blendOnDevice(scene);
                    checkPixels(scene, drawn, kUsualBound<Splat>);
                }
}

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
                CHECK((codes.empty() || known > 40));
            }
            for (const uint32_t passes : {2u, 3u}) {
                CAPTURE(passes);
                CHECK(blendOnDevice(scene, passes) == whole);
                CHECK(blendOnDevice(scene, passes, 2) == whole);
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

// Of the longest lists the first units leave of a pair of sub-tiles either, both or none: each goes on behind them, or not.
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

template <typename Splat>
void checkEmpty()
{
    for (const uint32_t passes : {1u, 2u})
        for (const bool empty_is_black : {true, false})
            for (const uint32_t any_positive : {0u, 1u}) {
                auto scene = emptyScene<Splat>({{33, 17}, {5, 40}}, 16, RasterRules::DiffGaussian);
                scene.splats.emplace_back(); // in no list
                scene.empty_is_black = empty_is_black;
                scene.any_positive = any_positive;
                const Drawn drawn = blendOnDevice(scene, passes, 1);
                const bool black = empty_is_black && any_positive == 0;
                for (uint32_t e = 0; e < 2; ++e)
                    for (size_t i = 0; i < drawn.images[e].size(); ++i)
                        if (drawn.images[e][i] != (black ? 0.0f : scene.background[i % 3])) {
                            CHECK(drawn.images[e][i] == (black ? 0.0f : scene.background[i % 3]));
                            break;
                        }
                CHECK(drawn.counters.evaluations[0] == 0);
            }
}

// Opaque splats over the whole image, then one of another colour that must not show.
template <typename Splat>
void checkSaturation()
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const uint32_t passes : {1u, 4u})
            for (const uint32_t longest : {0u, 9u}) {
                auto scene = emptyScene<Splat>({{50, 30}}, 16, raster);
                Ellipse e{25, 15, 1e6f, 0, 1e6f, 1, {1, 0, 0}, {0, 0, 4, 2}};
                for (int i = 0; i < 8; ++i) // the second would leave too little and is not drawn
                    addSplat(scene, 0, e);
                e.color[0] = 0;
                e.color[1] = 1;
                for (int i = 0; i < 3000; ++i)
                    addSplat(scene, 0, e);
                const Drawn drawn = blendOnDevice(scene, passes, longest);
                bool red = true, green = false;
                const std::vector<float>& image = drawn.images[0];
                const float at_least = raster == RasterRules::Gsplat ? 0.9989f : 0.9899f;
                for (size_t i = 0; i < image.size(); i += 3) {
                    red &= image[i] >= at_least && image[i] <= 1;
                    green |= image[i + 1] > 0.02f; // of the background, what the last red one would have covered
                }
                CHECK(red);
                CHECK_FALSE(green);
                // a list ends with the batch in which the last pixel is finished
                CHECK(drawn.counters.evaluations[0] <= 64u * 32 * 1024);
            }
}

} // namespace

TEST_CASE("blend fast: image sizes around a bin, few splats and many, both rasterisers and bin heights")
{
    checkSizes<PackedSplat>();
}

TEST_CASE("blend exact: image sizes around a bin, few splats and many, both rasterisers and bin heights")
{
    checkSizes<ExactSplat>();
}

TEST_CASE("blend: a warp goes on with the sub-tiles of a long list that take light, be it either, both or none")
{
    checkHalves<PackedSplat>();
    checkHalves<ExactSplat>();
}

TEST_CASE("blend fast: long lists and passes give the bytes of the ordinary way; two eyes of their own sizes")
{
    checkSameBytes<PackedSplat>();
}

TEST_CASE("blend exact: long lists and passes give the bytes of the ordinary way; two eyes of their own sizes")
{
    checkSameBytes<ExactSplat>();
}

TEST_CASE("trap 25: blend of nothing is the background, or black")
{
    checkEmpty<PackedSplat>();
    checkEmpty<ExactSplat>();
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

TEST_CASE("blend: finished pixels take no more, and a finished bin ends its list")
{
    checkSaturation<PackedSplat>();
    checkSaturation<ExactSplat>();
}

TEST_CASE("blend fast: a needle is drawn to its ends, whose radius its inverse no longer tells")
{
    for (const float sigma : {300.0f, 1000.0f, 4000.0f})
        for (const float angle : {0.0f, 0.3f, 0.8f}) {
            CAPTURE(sigma);
            CAPTURE(angle);
            auto scene = emptyScene<PackedSplat>({{200, 90}}, 16, RasterRules::DiffGaussian);
            const float ca = std::cos(angle), sa = std::sin(angle), s1 = sigma * sigma, s2 = 0.4f;
            const Ellipse e{100,
                            45,
                            s1 * ca * ca + s2 * sa * sa,
                            (s1 - s2) * ca * sa,
                            s1 * sa * sa + s2 * ca * ca,
                            0.8f,
                            {1, 0.5f, 0.2f},
                            {0, 0, 13, 6}};
            addSplat(scene, 0, e);
            const Drawn drawn = blendOnDevice(scene);
            checkPixels(scene, drawn, 1.0);
            // where it leaves the image, far within its three sigma
            const auto x = uint32_t(100 + std::min(99.0f, 44 / std::max(std::tan(angle), 1e-3f)));
            const auto y = uint32_t(std::lround(45 + (float(x) - 100) * std::tan(angle)));
            CHECK(drawn.images[0][(size_t(y) * 200 + x) * 3] > 0.2f);
        }
}

TEST_CASE("blend: an image of as many bins as there can be")
{
    for (const Size& size : {Size{3, kMaxBins * 32 - 5}, Size{kMaxBins * kBinWidth - 3, 2}}) {
        const auto scene = randomScene<PackedSplat>({size}, 32, RasterRules::DiffGaussian, 500, 8);
        checkPixels(scene, blendOnDevice(scene), kUsualBound<PackedSplat>);
    }
}
