// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_files.h"

#include "convert/export/spz/spz_container.h"
#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace gsc {

namespace {

constexpr size_t kPieceBytes = 1u << 18;
constexpr int kMostFraction = 20; // most bits behind the binary point: a micrometre if a world unit is a metre
constexpr float kColorScale = 0.15f, kHalfRoot = 0.70710678f;
constexpr float kFlip[3] = {1, -1, -1};
constexpr size_t kShBits[2] = {5, 4}; // bits that are kept of colour coefficients of degree 1, and of degrees 2 and 3

uint8_t byteOf(float value)
{
    return uint8_t(std::clamp(std::round(value), 0.0f, 255.0f));
}

// Stores a colour coefficient as the byte 128 + 128 x value. Low bits that are not kept become 0, because the file then
// compresses better.
uint8_t packSh(float value, size_t bits)
{
    const int step = 1 << (8 - bits), exact = int(std::round(std::clamp(value, -2.0f, 2.0f) * 128)) + 128;
    return uint8_t(std::clamp((exact + step / 2) / step * step, 0, 255));
}

// Packs x, y, z, w into 32 bits: 2 bits tell which is the largest, and each of the other three has a sign and 9 bits.
uint32_t packRotation(const float (&q)[4])
{
    uint32_t largest = 0;
    for (uint32_t i = 1; i < 4; ++i)
        if (std::abs(q[i]) > std::abs(q[largest]))
            largest = i;
    uint32_t packed = largest;
    for (uint32_t i = 0; i < 4; ++i)
        if (i != largest) {
            const auto size = uint32_t(511 * std::min(std::abs(q[i]) / kHalfRoot, 1.0f) + 0.5f);
            packed = packed << 10 | uint32_t((q[i] < 0) != (q[largest] < 0)) << 9 | size;
        }
    return packed;
}

void unpackRotation(uint32_t packed, float (&q)[4])
{
    const uint32_t largest = packed >> 30;
    float rest = 1;
    for (uint32_t i = 4; i-- > 0;)
        if (i != largest) {
            q[i] = kHalfRoot * float(packed & 511u) / 511 * ((packed >> 9 & 1u) != 0 ? -1.0f : 1.0f);
            rest -= q[i] * q[i];
            packed >>= 10;
        }
    q[largest] = std::sqrt(std::max(rest, 0.0f));
}

// Most bits behind the binary point with which all coordinates fit into 24 bits.
int fractionBits(const GaussianSet& set)
{
    float most = 0;
    for (const float p : set.position)
        most = std::max(most, std::abs(p));
    int bits = kMostFraction;
    while (bits >= 0 && std::ldexp(most, bits) > 8388606)
        --bits;
    if (bits < 0)
        throw Error(ErrorCode::Unsupported, "spz", formatString("a Gaussian at %g from the origin", double(most)),
                    "less than 8388606", "choose --to ply");
    return bits;
}

// Passes the bytes of one stream of the file to `add`.
void packStream(const GaussianSet& set, int fraction, size_t stream, const ByteSink& add)
{
    const size_t values = set.colorValues();
    std::vector<uint8_t> bytes;
    const auto store = [&bytes](uint32_t value, int bits) {
        for (int shift = 0; shift < bits; shift += 8)
            bytes.push_back(uint8_t(value >> shift));
    };
    for (size_t i = 0; i < set.size(); ++i) {
        const float *color = set.color.data() + i * values, *q = set.rotation.data() + 4 * i;
        switch (stream) {
        case 0:
            for (size_t c = 0; c < 3; ++c)
                store(uint32_t(int32_t(std::lround(std::ldexp(kFlip[c] * set.position[3 * i + c], fraction)))), 24);
            break;
        case 1:
            bytes.push_back(byteOf(255 * set.opacity[i]));
            break;
        case 2:
            for (size_t c = 0; c < 3; ++c)
                bytes.push_back(byteOf((color[c] * kColorScale + 0.5f) * 255));
            break;
        case 3:
            for (size_t c = 0; c < 3; ++c)
                bytes.push_back(byteOf((set.log_scale[3 * i + c] + 10) * 16));
            break;
        case 4: // rotations, turned like the axes
            store(packRotation({q[1], kFlip[1] * q[2], kFlip[2] * q[3], q[0]}), 32);
            break;
        default:
            for (size_t at = 3; at < values; ++at)
                bytes.push_back(packSh(kShFlipYz[at / 3] * color[at], kShBits[at / 3 < 4 ? 0 : 1]));
        }
        if (bytes.size() >= kPieceBytes) {
            add(bytes);
            bytes.clear();
        }
    }
    add(bytes);
}

} // namespace

void writeGaussianSpz(const GaussianSet& set, const PieceSink& write, int version)
{
    if (set.size() > INT32_MAX)
        throw Error(ErrorCode::Unsupported, "spz", formatString("%zu Gaussians", set.size()), "fewer than 2^31",
                    "choose --max-gaussians");
    const int fraction = fractionBits(set);
    const SpzHeader header{uint32_t(set.size()), uint8_t(set.degree), uint8_t(fraction)};
    (version == 4 ? writeSpz4 : writeSpz3)(
        header, [&](size_t stream, const ByteSink& add) { packStream(set, fraction, stream, add); }, write);
}

GaussianSet readGaussianSpz(std::span<const std::byte> file, const std::string& name)
{
    const bool plain = file.size() >= sizeof(kSpzMagic) && std::memcmp(file.data(), &kSpzMagic, sizeof(kSpzMagic)) == 0;
    const auto [header, bytes] = (plain ? readSpz4 : readSpz3)(file, name);
    GaussianSet set;
    set.degree = header.degree;
    const size_t n = header.count, values = set.colorValues();
    const int fraction = header.fraction;
    const uint8_t* at = bytes.data();
    for (size_t i = 0; i < 3 * n; ++i, at += 3) {
        const auto fixed = int32_t((uint32_t(at[0]) | uint32_t(at[1]) << 8 | uint32_t(at[2]) << 16) << 8) >> 8;
        set.position.push_back(kFlip[i % 3] * std::ldexp(float(fixed), -fraction));
    }
    for (size_t i = 0; i < n; ++i)
        set.opacity.push_back(float(*at++) / 255);
    set.color.resize(n * values);
    for (size_t i = 0; i < 3 * n; ++i)
        set.color[i / 3 * values + i % 3] = (float(*at++) / 255 - 0.5f) / kColorScale;
    for (size_t i = 0; i < 3 * n; ++i)
        set.log_scale.push_back(float(*at++) / 16 - 10);
    for (size_t i = 0; i < n; ++i, at += 4) {
        float q[4];
        unpackRotation(uint32_t(at[0]) | uint32_t(at[1]) << 8 | uint32_t(at[2]) << 16 | uint32_t(at[3]) << 24, q);
        set.rotation.insert(set.rotation.end(), {q[3], q[0], kFlip[1] * q[1], kFlip[2] * q[2]});
    }
    for (size_t i = 0; i < n; ++i)
        for (size_t k = 3; k < values; ++k)
            set.color[i * values + k] = kShFlipYz[k / 3] * (float(*at++) - 128) / 128;
    set.score.assign(n, 0.0f);
    return set;
}

} // namespace gsc
