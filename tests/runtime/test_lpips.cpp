// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/lpips.h"
#include "tests/runtime/lpips_reference.h"
#include "tests/support/lpips_random.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

const LpipsWeights& randomWeights()
{
    static const LpipsWeights weights = lpipsRandomWeights();
    return weights;
}

// The features of one stage and picture, put together from the strips.
struct Plane {
    uint32_t width = 0, channels = 0;
    std::vector<float> values;
    std::vector<int> seen; // how often each row came

    void add(const LpipsFeatures& part)
    {
        width = part.width;
        channels = part.channels;
        const size_t end = part.first_row + part.rows;
        if (seen.size() < end) {
            seen.resize(end);
            values.resize(end * width * channels);
        }
        for (uint32_t y = 0; y < part.rows; ++y) {
            ++seen[part.first_row + y];
            for (uint32_t x = 0; x < width; ++x)
                for (uint32_t c = 0; c < channels; ++c)
                    values[(size_t(part.first_row + y) * width + x) * channels + c] =
                        part.values[y * part.row_pitch + x * part.pixel_pitch + c];
        }
    }
    [[nodiscard]] double mean() const
    {
        double sum = 0;
        for (const float value : values)
            sum += double(value);
        return sum / double(values.size());
    }
};

} // namespace

TEST_CASE("LPIPS: features, distance of each stage and total are PyTorch's")
{
    const uint32_t width = kLpipsReferenceWidth, height = kLpipsReferenceHeight;
    const std::vector<float> a = lpipsRandomPicture(0, width, height), b = lpipsRandomPicture(1, width, height);
    Plane planes[kLpipsStages][2];
    std::mutex mutex;
    const Lpips lpips(randomWeights(), 3);
    const LpipsDistance distance =
        lpips.distance({a.data(), width, height}, {b.data(), width, height}, [&](const LpipsFeatures& part) {
            const std::lock_guard lock(mutex);
            planes[part.stage][part.image].add(part);
        });

    constexpr double kRelative = 1e-4;
    double total = 0;
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage) {
        CAPTURE(stage);
        const LpipsReference& expected = kLpipsReference[stage];
        for (uint32_t image = 0; image < 2; ++image) {
            const Plane& plane = planes[stage][image];
            REQUIRE(plane.width == expected.width);
            REQUIRE(plane.seen == std::vector<int>(expected.height, 1));
            CHECK(plane.mean() == doctest::Approx(expected.mean[image]).epsilon(kRelative));
        }
        const Plane& plane = planes[stage][1];
        for (const LpipsReference::Sample& sample : expected.samples) {
            const float value =
                plane.values[(size_t(sample.y) * plane.width + sample.x) * plane.channels + sample.channel];
            // what PyTorch rectified to zero is within the rounding of sums of the mean's size
            const double scale = std::max(double(sample.value), expected.mean[1]);
            CHECK(std::abs(double(value) - double(sample.value)) <= kRelative * scale);
        }
        CHECK(distance.stage[stage] == doctest::Approx(expected.distance).epsilon(kRelative));
        total += expected.distance;
    }
    CHECK(distance.total == doctest::Approx(total).epsilon(kRelative));
}

TEST_CASE("LPIPS does not depend on threads, is symmetric, and zero between equal pictures")
{
    const uint32_t width = 70, height = 41;
    const std::vector<float> a = lpipsRandomPicture(0, width, height), b = lpipsRandomPicture(1, width, height);
    const ImageView first{a.data(), width, height}, second{b.data(), width, height};
    const LpipsDistance one = Lpips(randomWeights(), 1).distance(first, second);
    const Lpips several(randomWeights(), 5);
    const LpipsDistance five = several.distance(first, second);
    CHECK(one.total == five.total);
    CHECK(one.stage == five.stage);
    CHECK(one.total > 0);
    CHECK(several.distance(second, first).total == doctest::Approx(one.total));
    CHECK(several.distance(first, first).total == 0);
}

TEST_CASE("LPIPS takes the smallest picture, and a pixel that is not finite makes it so")
{
    const uint32_t side = kLpipsSmallest;
    std::vector<float> a = lpipsRandomPicture(0, side, side), b = lpipsRandomPicture(1, side, side);
    const Lpips lpips(randomWeights(), 2);
    CHECK(lpips.distance({a.data(), side, side}, {b.data(), side, side}).total > 0);
    b[100] = std::numeric_limits<float>::quiet_NaN();
    CHECK(std::isnan(lpips.distance({a.data(), side, side}, {b.data(), side, side}).total));
}
