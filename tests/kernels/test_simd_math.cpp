// SPDX-License-Identifier: Apache-2.0
// Accuracy of the vector functions against double precision, on every instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/kernels/test_simd_math.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"

#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

V exp2Of(D d, const OctaveTable& octave, V v)
{
    V out;
    exp2Steps<1>(d, octave, &v, &out);
    return out;
}

// `count` is a multiple of 16.
void evaluate(int which, const float* in, float* out, size_t count)
{
    const LaneTag d;
    const OctaveTable octave;
    for (size_t i = 0; i < count; i += hn::Lanes(d)) {
        const auto v = hn::LoadU(d, in + i);
        hn::StoreU(which == 0   ? expAny(d, v)
                   : which == 1 ? sigmoidAny(d, v)
                   : which == 2 ? tanhAny(d, v)
                   : which == 3 ? roughLog(d, v)
                   : which == 4 ? reciprocalSqrt(d, v)
                                : exp2Of(d, octave, v),
                   d, out + i);
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "tests/kernels/simd_targets.h"

#include <doctest/doctest.h>

#include <algorithm>

#include <cmath>
#include <limits>
#include <vector>

namespace gsc {

HWY_EXPORT(evaluate);

namespace {

std::vector<float> apply(int which, std::vector<float> in)
{
    const size_t count = in.size();
    in.resize((count + 15) / 16 * 16, 1.0f);
    std::vector<float> out(in.size());
    HWY_DYNAMIC_DISPATCH(evaluate)(which, in.data(), out.data(), in.size());
    out.resize(count);
    return out;
}

std::vector<float> range(float low, float high, size_t steps)
{
    std::vector<float> values;
    for (size_t i = 0; i <= steps; ++i)
        values.push_back(low + (high - low) * float(i) / float(steps));
    return values;
}

// Largest error in units of the last place of the true value.
template <typename Truth>
double worstUlp(int which, const std::vector<float>& in, Truth&& truth)
{
    const std::vector<float> out = apply(which, in);
    double worst = 0;
    for (size_t i = 0; i < in.size(); ++i) {
        const double expected = truth(double(in[i]));
        const double ulp = double(std::nextafter(float(std::abs(expected)), 3e38f)) - double(float(std::abs(expected)));
        worst = std::max(worst, std::abs(double(out[i]) - expected) / ulp);
    }
    return worst;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

} // namespace

TEST_CASE("exp, sigmoid and tanh stay within their stated accuracy")
{
    test::forEachTarget([](const char* target) {
        CAPTURE(target);
        CHECK(worstUlp(0, range(-6, 0, 200000), [](double v) { return std::exp(v); }) < 1.5);
        CHECK(worstUlp(0, range(-86, 88.6f, 200000), [](double v) { return std::exp(v); }) < 2.5);
        CHECK(worstUlp(1, range(-79, 80, 200000), [](double v) { return 1 / (1 + std::exp(-v)); }) < 3);
        CHECK(worstUlp(2, range(-10, 10, 200000), [](double v) { return std::tanh(v); }) < 4);
        CHECK(worstUlp(2, range(-1e-3f, 1e-3f, 20001), [](double v) { return std::tanh(v); }) < 4);
        for (const float scale : {1e-12f, 1.0f, 1e9f})
            CHECK(worstUlp(4, range(scale, 4 * scale, 200000), [](double v) { return 1 / std::sqrt(v); }) < 2);
    });
}

TEST_CASE("powers of two by steps of an octave stay within their stated accuracy")
{
    test::forEachTarget([](const char* target) {
        CAPTURE(target);
        for (const float reach : {8.0f, 124.0f}) {
            const std::vector<float> in = range(-reach, reach, 400000), out = apply(5, in);
            double worst = 0;
            for (size_t i = 0; i < in.size(); ++i)
                worst = std::max(worst, std::abs(double(out[i]) / std::exp2(double(in[i])) - 1));
            CHECK(worst < 6e-7);
        }
    });
}

TEST_CASE("trap 15, trap 18: infinities and NaN pass through the vector functions")
{
    test::forEachTarget([](const char* target) {
        CAPTURE(target);
        const std::vector<float> special = {-kInf, kInf, kNan, -200, 200, 0, -0.0f};
        const std::vector<float> e = apply(0, special), s = apply(1, special), t = apply(2, special);
        CHECK(e[0] == 0.0f);
        CHECK(e[1] == kInf);
        CHECK(std::isnan(e[2]));
        CHECK(e[3] == 0.0f);
        CHECK(e[4] == kInf);
        CHECK(e[5] == 1.0f);
        CHECK(s[0] < 1e-30f);
        CHECK(s[1] == 1.0f);
        CHECK(std::isnan(s[2]));
        CHECK(s[5] == 0.5f);
        CHECK(t[0] == -1.0f);
        CHECK(t[1] == 1.0f);
        CHECK(std::isnan(t[2]));
        CHECK(t[5] == 0.0f);
    });
}

TEST_CASE("the rough logarithm keeps the margin its callers rely on")
{
    test::forEachTarget([](const char* target) {
        CAPTURE(target);
        const std::vector<float> in = range(1, 255, 100000), out = apply(3, in);
        double worst = 0;
        for (size_t i = 0; i < in.size(); ++i)
            worst = std::max(worst, std::abs(double(out[i]) - std::log(double(in[i]))));
        CHECK(worst < 1e-3);
    });
}

} // namespace gsc
#endif
