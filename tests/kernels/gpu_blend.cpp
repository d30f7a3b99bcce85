// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/gpu_blend.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>

namespace gsc::test {

namespace {

void launch(const BlendCudaArgs& args, const PackedSplat*)
{
    blendFastCuda(args, kTestProcessors, testStream().handle);
}
void launch(const BlendCudaArgs& args, const ExactSplat*)
{
    blendExactCuda(args, kTestProcessors, testStream().handle);
}

} // namespace

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

template <typename Splat>
Drawn blendOnDevice(const BlendScene<Splat>& scene, uint32_t passes, uint32_t longest,
                    const std::vector<uint16_t>& codes, bool has_longest)
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
        std::vector<SortKey> keys;
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
        while (counters.pass.longest_bins < counters.pass.long_bins &&
               ((has_longest && counters.pass.longest_bins == 0) ||
                counts[queue[counters.pass.longest_bins]] > kFirstUnits * kTouchUnit))
            ++counters.pass.longest_bins;
        counters.pass.touch_units = uint32_t(units.size());
        const GuardedBuffer<TouchUnit> device_units(units);
        const GuardedBuffer<uint32_t> bin_units(unit_of), touch(units.size() * touchWords(scene.grid)),
            unfinished(std::vector<uint32_t>(bins, 0u));
        const size_t segments = segmentCapacity(units.size());
        const GuardedBuffer<SegmentPixel> segment_pixels(segments * pixelsOfBin(scene.grid));
        const GuardedBuffer<uint32_t> segment_pairs(segments * pairsOfBin(scene.grid)),
            segment_queue(segmentQueueWords(scene.grid, units.size(), kTestProcessors));
        const GuardedBuffer<SegmentState> segment_states(segments * pairsOfBin(scene.grid));
        const GuardedBuffer<SortKey> device_keys(keys);
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
        args.segments = segment_pixels.get();
        args.segment_pairs = segment_pairs.get();
        args.segment_queue = segment_queue.get();
        args.segment_states = segment_states.get();
        args.keys = device_keys.get();
        args.pair_capacity = uint32_t(keys.size());
        args.counters = device_counters.get();
        launch(args, static_cast<const Splat*>(nullptr));
        for (const bool whole :
             {splats.intact(), image[0].intact(), image[1].intact(), left[0].intact(), left[1].intact(),
              depth[0].intact(), depth[1].intact(), device_keys.intact(), cells.intact(), bin_queue.intact(),
              device_counters.intact(), device_units.intact(), bin_units.intact(), touch.intact(), unfinished.intact(),
              segment_pixels.intact(), segment_pairs.intact(), segment_queue.intact(), segment_states.intact()})
            CHECK(whole);
        drawn.counters = device_counters.read()[0];
        drawn.unfinished = unfinished.read();
        drawn.segment_queue = segment_queue.read();
    }
    for (uint32_t e = 0; e < eye_count; ++e) {
        drawn.images[e] = image[e].read();
        drawn.depths[e] = depth[e].read();
    }
    return drawn;
}

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

template Drawn blendOnDevice<PackedSplat>(const BlendScene<PackedSplat>&, uint32_t, uint32_t,
                                          const std::vector<uint16_t>&, bool);
template Drawn blendOnDevice<ExactSplat>(const BlendScene<ExactSplat>&, uint32_t, uint32_t,
                                         const std::vector<uint16_t>&, bool);
template void checkPixels<PackedSplat>(const BlendScene<PackedSplat>&, const Drawn&, double);
template void checkPixels<ExactSplat>(const BlendScene<ExactSplat>&, const Drawn&, double);

} // namespace gsc::test
