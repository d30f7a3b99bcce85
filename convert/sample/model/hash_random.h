// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend only on their key. So any part of a scene can be made by itself, and the bytes do not
// depend on the standard library.
#pragma once

#include <cmath>
#include <cstdint>

namespace gsc {

constexpr uint64_t mixBits(uint64_t x) // the last step of the generator splitmix64
{
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

constexpr uint64_t hashKey(uint64_t a, uint64_t b = 0, uint64_t c = 0)
{
    return mixBits(mixBits(mixBits(a) ^ b) ^ c);
}

constexpr double hashUnit(uint64_t key) // returns a number in [0, 1)
{
    return double(mixBits(key) >> 11) * 0x1p-53;
}

class HashRandom {
public:
    explicit HashRandom(uint64_t key) : m_key(key) {}

    uint64_t bits() { return mixBits(m_key++ * 0xd1342543de82ef95ull + 1); }
    double unit() { return double(bits() >> 11) * 0x1p-53; }
    double between(double a, double b) { return a + (b - a) * unit(); }
    uint32_t below(uint32_t n) { return uint32_t(unit() * n); }
    bool chance(double p) { return unit() < p; }

private:
    uint64_t m_key;
};

// Smooth noise in [0, 1): one random value per cell of width 1, interpolated.
inline double valueNoise(double x, double y, uint64_t seed)
{
    const double fx = std::floor(x), fy = std::floor(y);
    const auto corner = [&](int dx, int dy) {
        return hashUnit(seed ^ (uint64_t(int64_t(fx) + dx) * 0x8da6b343u) ^
                        (uint64_t(int64_t(fy) + dy) * 0xd8163841ull << 20));
    };
    double tx = x - fx, ty = y - fy;
    tx = tx * tx * (3 - 2 * tx);
    ty = ty * ty * (3 - 2 * ty);
    const double low = corner(0, 0) * (1 - tx) + corner(1, 0) * tx;
    const double high = corner(0, 1) * (1 - tx) + corner(1, 1) * tx;
    return low * (1 - ty) + high * ty;
}

inline double fractalNoise(double x, double y, uint64_t seed, int octaves)
{
    double sum = 0, weight = 0.5, total = 0;
    for (int i = 0; i < octaves; ++i, weight *= 0.5, x *= 2.03, y *= 2.03) {
        sum += weight * valueNoise(x, y, seed + uint64_t(i) * 7919);
        total += weight;
    }
    return sum / total;
}

} // namespace gsc
