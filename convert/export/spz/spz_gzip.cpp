// SPDX-License-Identifier: Apache-2.0
#include "convert/export/spz/spz_container.h"

#include <gsc/error.h>

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>

namespace gsc {

namespace {

constexpr uint32_t kVersion = 3;
constexpr size_t kHeaderBytes = 16, kPieceBytes = 1u << 18;

// Compresses bytes to a gzip frame, piece by piece.
class Gzip {
public:
    explicit Gzip(const PieceSink& write) : m_write(write), m_out(kPieceBytes)
    {
        constexpr int kGzip = 15 + 16, kLevel = 9, kMemory = 9;
        if (deflateInit2(&m_stream, kLevel, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
            throw Error(ErrorCode::OutOfMemory, "deflate", "no memory", "300 KB", "close other programs");
    }
    ~Gzip() { deflateEnd(&m_stream); }
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;

    void add(std::span<const uint8_t> bytes, bool last = false)
    {
        while (true) { // in parts, because zlib counts bytes in 32 bits
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

} // namespace

std::array<uint64_t, kSpzStreams> spzStreamBytes(const SpzHeader& header)
{
    const uint64_t n = header.count;
    return {9 * n, n, 3 * n, 3 * n, 4 * n, 3 * n * (shValues(header.degree) - 1)};
}

void writeSpz3(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write)
{
    Gzip gzip(write);
    std::array<uint8_t, kHeaderBytes> head{};
    const uint32_t words[3] = {kSpzMagic, kVersion, header.count};
    std::memcpy(head.data(), words, sizeof(words));
    head[12] = header.degree;
    head[13] = header.fraction;
    gzip.add(head);
    for (size_t stream = 0; stream < kSpzStreams; ++stream)
        pack(stream, [&gzip](std::span<const uint8_t> bytes) { gzip.add(bytes); });
    gzip.add({}, true);
}

SpzContent readSpz3(std::span<const std::byte> file, const std::string& name)
{
    z_stream stream{};
    if (inflateInit2(&stream, 15 + 16) != Z_OK)
        throw Error(ErrorCode::OutOfMemory, name, "no memory", "40 KB", "close other programs");
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
    uint32_t words[3] = {};
    if (state == Z_STREAM_END && bytes.size() >= kHeaderBytes)
        std::memcpy(words, bytes.data(), sizeof(words));
    if (words[0] != kSpzMagic || words[1] != kVersion || bytes[12] > kMostShDegree)
        throw Error(ErrorCode::InvalidFile, name, "no gzip stream with the header of SPZ version 3", "one",
                    "export it again");
    const SpzHeader header{words[2], bytes[12], bytes[13]};
    const std::array<uint64_t, kSpzStreams> sizes = spzStreamBytes(header);
    const uint64_t wanted = std::accumulate(sizes.begin(), sizes.end(), uint64_t(kHeaderBytes));
    if (bytes.size() != wanted)
        throw Error(
            ErrorCode::InvalidFile, name,
            formatString("%zu bytes for %u Gaussians of degree %d", bytes.size(), header.count, int(header.degree)),
            formatString("%llu", (unsigned long long)wanted), "export it again");
    bytes.erase(bytes.begin(), bytes.begin() + kHeaderBytes);
    return {header, std::move(bytes)};
}

} // namespace gsc
