// SPDX-License-Identifier: Apache-2.0
// Stands for the header of this path, which only nvcc compiles.
#pragma once

#include "tests/cuda_emulation/halves.h"
#include "tests/cuda_emulation/intrinsics.h"

#include <chrono>

#define GSC_DYNAMIC_SHARED(name) unsigned char* const name = gsc_emulation::dynamicShared()

namespace gsc {

// note: the sum of the seventeen is rounded once; the hardware's own rounding is not documented
inline void mmaM16N8K16(float* d, const uint32_t* a, uint2 b, GSC_EMULATION_CALLER)
{
    struct Operand {
        float* d;
        const uint32_t* a;
        uint2 b;
    };
    Operand mine{d, a, b};
    gsc_emulation::meetWarp({"mma.sync", caller, line}, ~0u, &mine,
                            [](const gsc_emulation::Site&, uint32_t, void* const* operands) {
                                const auto half = [](uint32_t pair, uint32_t i) {
                                    return gsc_emulation::floatOfHalf(uint16_t(pair >> 16 * i));
                                };
                                float left[16][16], right[16][8];
                                for (uint32_t lane = 0; lane < 32; ++lane) {
                                    const auto& o = *static_cast<const Operand*>(operands[lane]);
                                    const uint32_t g = lane >> 2, t = lane & 3u;
                                    for (uint32_t i = 0; i < 2; ++i) {
                                        for (uint32_t r = 0; r < 4; ++r)
                                            left[g + 8 * (r & 1u)][2 * t + 8 * (r >> 1) + i] = half(o.a[r], i);
                                        right[2 * t + i][g] = half(o.b.x, i);
                                        right[2 * t + 8 + i][g] = half(o.b.y, i);
                                    }
                                }
                                double sum[16][8] = {};
                                for (uint32_t row = 0; row < 16; ++row)
                                    for (uint32_t k = 0; k < 16; ++k)
                                        for (uint32_t column = 0; column < 8; ++column)
                                            sum[row][column] += double(left[row][k]) * double(right[k][column]);
                                for (uint32_t lane = 0; lane < 32; ++lane) {
                                    float* to = static_cast<const Operand*>(operands[lane])->d;
                                    const uint32_t g = lane >> 2, t = lane & 3u;
                                    for (uint32_t i = 0; i < 4; ++i)
                                        to[i] = float(double(to[i]) + sum[g + 8 * (i >> 1)][2 * t + (i & 1u)]);
                                }
                            });
}

inline uint32_t halvesRelu(float low, float high)
{
    const auto relu = [](float v) { return v <= 0.0f ? 0.0f : v > 65504.0f ? 65504.0f : v; };
    return gsc_emulation::halfOfFloat(relu(low)) | uint32_t(gsc_emulation::halfOfFloat(relu(high))) << 16;
}

inline void keepComputed(uint32_t&) {}

// Reads it, so that a sanitizer sees what lies outside of its array; the hardware would not mind.
inline void prefetchGlobal(const void* address)
{
    static_cast<void>(*static_cast<const volatile char*>(address));
}

inline float exp2Approx(float v)
{
    const float e = std::exp2(v);
    return e < 0x1p-126f ? 0.0f : e;
}

inline void addColorWhere(float light, float least, float weight, const float* color, float* sum)
{
    for (int i = 0; i < 3 && light >= least; ++i)
        sum[i] = std::fma(weight, color[i], sum[i]);
}

inline float sqrtApprox(float v)
{
    return std::sqrt(v);
}

inline void barrierSync(uint32_t id, uint32_t threads, GSC_EMULATION_CALLER)
{
    gsc_emulation::meetBlock({"bar.sync", caller, line}, id, threads, false);
}

inline bool barrierAny(uint32_t id, uint32_t threads, bool value, GSC_EMULATION_CALLER)
{
    return gsc_emulation::meetBlock({"bar.red.or", caller, line}, id, threads, value);
}

// note: kernels follow each other here
inline void launchDependents() {}
inline void waitForEarlier() {}

inline uint32_t loadNow(const uint32_t* at)
{
    return *at;
}

inline uint32_t loadAcquire(const uint32_t* at)
{
    return *at;
}

inline unsigned long long deviceNanoseconds()
{
    return uint64_t(std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count());
}

} // namespace gsc
