// SPDX-License-Identifier: Apache-2.0
#include "convert/explicit/gaussian_files.h"

#include "format/error.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace gsc {

namespace {

constexpr uint32_t kMagic = 0x5053474e, kVersion = 3;
constexpr size_t kHeaderBytes = 16, kPieceBytes = 1u << 18;
constexpr int kMostFraction = 20; // bits: a micrometre where a unit is a metre
constexpr float kColorScale = 0.15f, kHalfRoot = 0.70710678f;
constexpr float kFlip[3] = {1, -1, -1};
constexpr size_t kShBits[2] = {5, 4}; // that are kept of degree 1, and of the others

uint8_t byteOf(float value)
{
    return uint8_t(std::clamp(std::round(value), 0.0f, 255.0f));
}

// Coefficients count from 128 in steps of 1 / 128; what is not kept of a byte packs to nothing.
uint8_t packSh(float value, size_t bits)
{
    const int step = 1 << (8 - bits), exact = int(std::round(std::clamp(value, -2.0f, 2.0f) * 128)) + 128;
    return uint8_t(std::clamp((exact + step / 2) / step * step, 0, 255));
}

// The smaller three of x, y, z, w by their size and sign in 10 bits each, and which the fourth is.
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

// One deflate stream in a gzip frame.
class Gzip {
public:
    explicit Gzip(const PieceSink& write) : m_write(write), m_out(kPieceBytes)
    {
        constexpr int kGzip = 15 + 16, kLevel = 9, kMemory = 9;
        if (deflateInit2(&m_stream, kLevel, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
            throw Error(ErrorCode::OutOfMemory, "deflate: no memory, expected 300 KB; close other programs");
    }
    ~Gzip() { deflateEnd(&m_stream); }
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;

    void add(std::span<const uint8_t> bytes, bool last = false)
    {
        while (true) { // zlib counts with 32 bits
            const std::span<const uint8_t> part = bytes.first(std::min<size_t>(bytes.size(), 1u << 30));
            bytes = bytes.subspan(part.size());
            m_stream.next_in = const_cast<uint8_t*>(part.data());
            m_stream.avail_in = uInt(part.size());
            drain(last && bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
            if (bytes.empty())
                return;
        }
    }

private:
    void drain(int flush)
    {
        do {
            m_stream.next_out = m_out.data();
            m_stream.avail_out = uInt(m_out.size());
            (void)deflate(&m_stream, flush);
            m_write(std::as_bytes(std::span(m_out).first(m_out.size() - m_stream.avail_out)));
        } while (m_stream.avail_out == 0);
    }

    const PieceSink& m_write;
    std::vector<uint8_t> m_out;
    z_stream m_stream{};
};

// The most bits behind the point with which all places fit into 24.
int fractionBits(const GaussianSet& set)
{
    float most = 0;
    for (const float p : set.position)
        most = std::max(most, std::abs(p));
    int bits = kMostFraction;
    while (bits >= 0 && std::ldexp(most, bits) > 8388606)
        --bits;
    if (bits < 0)
        throw Error(ErrorCode::Unsupported,
                    formatString("spz: a Gaussian at %g from the origin, expected less than 8388606; choose --to ply",
                                 double(most)));
    return bits;
}

} // namespace

void writeGaussianSpz(const GaussianSet& set, const PieceSink& write)
{
    if (set.size() > INT32_MAX)
        throw Error(ErrorCode::Unsupported, formatString("spz: %zu Gaussians, expected fewer than 2^31; choose "
                                                         "--max-gaussians",
                                                         set.size()));
    const int fraction = fractionBits(set);
    Gzip gzip(write);
    std::vector<uint8_t> bytes(kHeaderBytes);
    const uint32_t head[3] = {kMagic, kVersion, uint32_t(set.size())};
    std::memcpy(bytes.data(), head, sizeof(head));
    bytes[12] = uint8_t(set.degree);
    bytes[13] = uint8_t(fraction);
    const auto flush = [&](bool always) {
        if (always || bytes.size() >= kPieceBytes) {
            gzip.add(bytes);
            bytes.clear();
        }
    };
    for (size_t i = 0; i < set.position.size(); ++i) {
        const auto fixed = int32_t(std::lround(std::ldexp(kFlip[i % 3] * set.position[i], fraction)));
        for (int shift = 0; shift < 24; shift += 8)
            bytes.push_back(uint8_t(uint32_t(fixed) >> shift));
        flush(false);
    }
    for (const float opacity : set.opacity) {
        bytes.push_back(byteOf(255 * opacity));
        flush(false);
    }
    const size_t values = set.colorValues();
    for (size_t i = 0; i < set.size(); ++i) {
        for (size_t c = 0; c < 3; ++c)
            bytes.push_back(byteOf((set.color[i * values + c] * kColorScale + 0.5f) * 255));
        flush(false);
    }
    for (const float scale : set.log_scale) {
        bytes.push_back(byteOf((scale + 10) * 16));
        flush(false);
    }
    for (size_t i = 0; i < set.size(); ++i) {
        const float* q = set.rotation.data() + 4 * i; // turned with the axes
        const uint32_t packed = packRotation({q[1], kFlip[1] * q[2], kFlip[2] * q[3], q[0]});
        for (int shift = 0; shift < 32; shift += 8)
            bytes.push_back(uint8_t(packed >> shift));
        flush(false);
    }
    for (size_t i = 0; i < set.size(); ++i) {
        for (size_t at = 3; at < values; ++at)
            bytes.push_back(packSh(kShFlipYz[at / 3] * set.color[i * values + at], kShBits[at / 3 < 4 ? 0 : 1]));
        flush(false);
    }
    flush(true);
    gzip.add({}, true);
}

GaussianSet readGaussianSpz(std::span<const std::byte> file, const std::string& name)
{
    const auto fail = [&name](const std::string& text) -> void {
        throw Error(ErrorCode::InvalidFile, name + ": " + text);
    };
    z_stream stream{};
    if (inflateInit2(&stream, 15 + 16) != Z_OK)
        throw Error(ErrorCode::OutOfMemory, name + ": no memory, expected 40 KB; close other programs");
    const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, inflateEnd);
    std::vector<uint8_t> bytes, piece(kPieceBytes);
    int state = Z_OK;
    std::span<const std::byte> rest = file;
    while (state == Z_OK) {
        if (stream.avail_in == 0) {
            const auto part = rest.first(std::min<size_t>(rest.size(), 1u << 30));
            rest = rest.subspan(part.size());
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(part.data()));
            stream.avail_in = uInt(part.size());
        }
        stream.next_out = piece.data();
        stream.avail_out = uInt(piece.size());
        state = inflate(&stream, Z_NO_FLUSH);
        bytes.insert(bytes.end(), piece.begin(), piece.end() - stream.avail_out);
    }
    uint32_t head[3] = {};
    if (state == Z_STREAM_END && bytes.size() >= kHeaderBytes)
        std::memcpy(head, bytes.data(), sizeof(head));
    if (head[0] != kMagic || head[1] != kVersion || bytes[12] > kMostShDegree)
        fail("no gzip stream with the header of SPZ version 3, expected one; export it again");
    GaussianSet set;
    set.degree = bytes[12];
    const size_t n = head[2], values = set.colorValues();
    if (bytes.size() != kHeaderBytes + n * (9 + 1 + 3 + 3 + 4 + values - 3))
        fail(formatString("%zu bytes for %zu Gaussians of degree %d, expected %zu; export it again", bytes.size(), n,
                          set.degree, kHeaderBytes + n * (20 + values - 3)));
    const int fraction = bytes[13];
    const uint8_t* at = bytes.data() + kHeaderBytes;
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
