// SPDX-License-Identifier: Apache-2.0
// CUDA C++'s keywords and device functions, as far as the kernels use them.
#pragma once

#include "tests/cuda_emulation/block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <math.h> // isfinite without std::

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline __attribute__((always_inline))
#define __launch_bounds__(...)
#define __grid_constant__
#define __align__(n) __attribute__((aligned(n)))
#define __shared__ static // one block runs at a time

#define GSC_EMULATION_CALLER const char *caller = __builtin_FUNCTION(), int line = __builtin_LINE()

namespace gsc_emulation {

template <typename In, typename Out>
struct Exchange {
    In in;
    Out out;
};

// Every lane of `mask` gets combine(all of their values).
template <typename T, typename Combine>
T reduceWarp(const Site& site, uint32_t mask, T value, Combine)
{
    Exchange<T, T> mine{value, {}};
    meetWarp(site, mask, &mine, [](const Site&, uint32_t lanes, void* const* operands) {
        bool any = false;
        T sum{};
        for (uint32_t l = 0; l < 32; ++l)
            if (lanes >> l & 1u) {
                const T v = static_cast<Exchange<T, T>*>(operands[l])->in;
                sum = any ? Combine()(sum, v) : v;
                any = true;
            }
        for (uint32_t l = 0; l < 32; ++l)
            if (lanes >> l & 1u)
                static_cast<Exchange<T, T>*>(operands[l])->out = sum;
    });
    return mine.out;
}

struct Add {
    uint32_t operator()(uint32_t a, uint32_t b) const { return a + b; }
};
struct Or {
    uint32_t operator()(uint32_t a, uint32_t b) const { return a | b; }
};
struct Smaller {
    uint32_t operator()(uint32_t a, uint32_t b) const { return a < b ? a : b; }
};
struct Larger {
    uint32_t operator()(uint32_t a, uint32_t b) const { return a > b ? a : b; }
};

inline float divideFast(float a, float b)
{
    const float size = std::fabs(b);
    if (size > 0x1p126f && size < INFINITY) // as the hardware does
        return std::isinf(a) ? NAN : std::copysign(0.0f, a);
    return a / b;
}

} // namespace gsc_emulation

inline uint32_t __activemask() // any set of lanes that has the caller is right
{
    return 1u << gsc_emulation::laneOfWarp();
}
inline void __syncwarp(uint32_t mask = ~0u, GSC_EMULATION_CALLER)
{
    gsc_emulation::meetWarp({"__syncwarp", caller, line}, mask, nullptr,
                            [](const gsc_emulation::Site&, uint32_t, void* const*) {});
}
inline uint32_t __ballot_sync(uint32_t mask, bool vote, GSC_EMULATION_CALLER)
{
    return gsc_emulation::reduceWarp({"__ballot_sync", caller, line}, mask,
                                     vote ? 1u << gsc_emulation::laneOfWarp() : 0u, gsc_emulation::Or());
}
inline int __any_sync(uint32_t mask, bool vote, GSC_EMULATION_CALLER)
{
    return int(gsc_emulation::reduceWarp({"__any_sync", caller, line}, mask, uint32_t(vote), gsc_emulation::Or()));
}
inline uint32_t __reduce_add_sync(uint32_t mask, uint32_t v, GSC_EMULATION_CALLER)
{
    return gsc_emulation::reduceWarp({"__reduce_add_sync", caller, line}, mask, v, gsc_emulation::Add());
}
inline uint32_t __reduce_or_sync(uint32_t mask, uint32_t v, GSC_EMULATION_CALLER)
{
    return gsc_emulation::reduceWarp({"__reduce_or_sync", caller, line}, mask, v, gsc_emulation::Or());
}
inline uint32_t __reduce_min_sync(uint32_t mask, uint32_t v, GSC_EMULATION_CALLER)
{
    return gsc_emulation::reduceWarp({"__reduce_min_sync", caller, line}, mask, v, gsc_emulation::Smaller());
}
inline uint32_t __reduce_max_sync(uint32_t mask, uint32_t v, GSC_EMULATION_CALLER)
{
    return gsc_emulation::reduceWarp({"__reduce_max_sync", caller, line}, mask, v, gsc_emulation::Larger());
}

template <typename T>
T __shfl_sync(uint32_t mask, T value, int from, GSC_EMULATION_CALLER)
{
    struct Operand {
        T value, result;
        uint32_t from;
    };
    Operand mine{value, {}, uint32_t(from) & 31u};
    gsc_emulation::meetWarp({"__shfl_sync", caller, line}, mask, &mine,
                            [](const gsc_emulation::Site& site, uint32_t lanes, void* const* operands) {
                                for (uint32_t l = 0; l < 32; ++l)
                                    if (lanes >> l & 1u) {
                                        auto* to = static_cast<Operand*>(operands[l]);
                                        if ((lanes >> to->from & 1u) == 0)
                                            gsc_emulation::fail(site,
                                                                "lane %u reads lane %u, which mask %08x does not name",
                                                                l, to->from, lanes);
                                        to->result = static_cast<Operand*>(operands[to->from])->value;
                                    }
                            });
    return mine.result;
}

template <typename T>
T __shfl_xor_sync(uint32_t mask, T value, int with, GSC_EMULATION_CALLER)
{
    return __shfl_sync(mask, value, int((threadIdx.x ^ uint32_t(with)) & 31u), caller, line);
}

template <typename T>
T __shfl_up_sync(uint32_t mask, T value, uint32_t by, GSC_EMULATION_CALLER)
{
    const uint32_t lane = threadIdx.x & 31u;
    return __shfl_sync(mask, value, int(lane >= by ? lane - by : lane), caller, line);
}

inline uint32_t __match_any_sync(uint32_t mask, uint32_t value, GSC_EMULATION_CALLER)
{
    using Operand = gsc_emulation::Exchange<uint32_t, uint32_t>;
    Operand mine{value, 0};
    gsc_emulation::meetWarp({"__match_any_sync", caller, line}, mask, &mine,
                            [](const gsc_emulation::Site&, uint32_t lanes, void* const* operands) {
                                for (uint32_t l = 0; l < 32; ++l)
                                    for (uint32_t m = 0; m < 32; ++m)
                                        if ((lanes >> l & 1u) && (lanes >> m & 1u) &&
                                            static_cast<Operand*>(operands[l])->in ==
                                                static_cast<Operand*>(operands[m])->in)
                                            static_cast<Operand*>(operands[l])->out |= 1u << m;
                            });
    return mine.out;
}

inline uint32_t __umulhi(uint32_t a, uint32_t b)
{
    return uint32_t(uint64_t(a) * b >> 32);
}

// Per byte, unsigned.
inline uint32_t __vminu4(uint32_t a, uint32_t b)
{
    uint32_t result = 0;
    for (uint32_t shift = 0; shift < 32; shift += 8)
        result |= std::min(a >> shift & 255u, b >> shift & 255u) << shift;
    return result;
}

inline uint32_t __vmaxu4(uint32_t a, uint32_t b)
{
    uint32_t result = 0;
    for (uint32_t shift = 0; shift < 32; shift += 8)
        result |= std::max(a >> shift & 255u, b >> shift & 255u) << shift;
    return result;
}

inline void __syncthreads(GSC_EMULATION_CALLER)
{
    gsc_emulation::meetBlock({"__syncthreads", caller, line}, 0, 0, false);
}
inline int __syncthreads_or(int value, GSC_EMULATION_CALLER)
{
    return int(gsc_emulation::meetBlock({"__syncthreads_or", caller, line}, 0, 0, value != 0));
}

inline void __threadfence() {}
inline void __nanosleep(uint32_t)
{
    gsc_emulation::letOthersRun();
}
template <typename T>
T __ldcg(const T* at)
{
    return *at;
}

// Blocks run one after another and fibers do not switch within, so a plain operation is atomic.
template <typename T>
T atomicAdd(T* at, T v)
{
    const T old = *at;
    *at = old + v;
    return old;
}
inline uint32_t atomicExch(uint32_t* at, uint32_t v)
{
    const uint32_t old = *at;
    *at = v;
    return old;
}
inline uint32_t atomicOr(uint32_t* at, uint32_t v)
{
    const uint32_t old = *at;
    *at = old | v;
    return old;
}
inline uint32_t atomicCAS(uint32_t* at, uint32_t expected, uint32_t v)
{
    const uint32_t was = *at;
    if (was == expected)
        *at = v;
    return was;
}

inline uint32_t atomicMin(uint32_t* at, uint32_t v)
{
    const uint32_t old = *at;
    *at = v < old ? v : old;
    return old;
}
inline uint32_t atomicMax(uint32_t* at, uint32_t v)
{
    const uint32_t old = *at;
    *at = v > old ? v : old;
    return old;
}

inline int min(int a, int b)
{
    return a < b ? a : b;
}
inline int max(int a, int b)
{
    return a > b ? a : b;
}
inline uint32_t min(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}
inline uint32_t max(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

inline int __popc(uint32_t v)
{
    return std::popcount(v);
}
inline int __clz(int v)
{
    return std::countl_zero(uint32_t(v));
}
inline int __ffs(int v)
{
    return v == 0 ? 0 : std::countr_zero(uint32_t(v)) + 1;
}
inline float __uint_as_float(uint32_t v)
{
    return std::bit_cast<float>(v);
}
inline uint32_t __float_as_uint(float v)
{
    return std::bit_cast<uint32_t>(v);
}

inline uint32_t __float2uint_rn(float v)
{
    if (!(v > 0.0f))
        return 0;
    const float r = std::nearbyint(v);
    return r >= 0x1p32f ? UINT32_MAX : uint32_t(r);
}

namespace gsc_emulation {
inline int wholeToInt(float v)
{
    return !(v == v) ? 0 : v >= 0x1p31f ? INT32_MAX : v < -0x1p31f ? INT32_MIN : int(v);
}
} // namespace gsc_emulation

inline int __float2int_rn(float v)
{
    return gsc_emulation::wholeToInt(std::nearbyint(v));
}
inline int __float2int_ru(float v)
{
    return gsc_emulation::wholeToInt(std::ceil(v));
}
inline int __float2int_rd(float v)
{
    return gsc_emulation::wholeToInt(std::floor(v));
}

// note: macros, because the C library declares functions of these names
inline float __fmul_rn(float a, float b)
{
    return a * b; // contraction is off in every translation unit
}
// Sum rounded toward zero, if it is positive. A double holds it but for what is far below the last bit of the result.
inline float __fadd_rz(float a, float b)
{
    const double sum = double(a) + double(b);
    const float rounded = float(sum);
    return double(rounded) > sum ? std::nextafter(rounded, 0.0f) : rounded;
}
// Four bytes of the eight of a, then b; a nibble of the selector each.
inline uint32_t __byte_perm(uint32_t a, uint32_t b, uint32_t selector)
{
    const uint64_t bytes = uint64_t(b) << 32 | a;
    uint32_t result = 0;
    for (uint32_t i = 0; i < 4; ++i)
        result |= uint32_t(bytes >> 8 * (selector >> 4 * i & 7u) & 255u) << 8 * i;
    return result;
}
// The upper word of high:low shifted to the left.
inline uint32_t __funnelshift_l(uint32_t low, uint32_t high, uint32_t by)
{
    return uint32_t((uint64_t(high) << 32 | low) << (by & 31u) >> 32);
}
inline float __fadd_rn(float a, float b)
{
    return a + b;
}
inline float __fsub_rn(float a, float b)
{
    return a - b;
}
#define __fdividef(a, b) gsc_emulation::divideFast(a, b)
#define __expf(v) std::exp(float(v))
#define __logf(v) std::log(float(v))
#define __log2f(v) std::log2(float(v))
#define rsqrtf(v) (1.0f / std::sqrt(float(v)))
#define norm3df(x, y, z) std::hypot(float(x), float(y), float(z))
