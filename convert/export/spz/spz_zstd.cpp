// SPDX-License-Identifier: Apache-2.0
#include "format/numbers/count_text.h"
#include "convert/export/spz/spz_container.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <zstd.h>

#include <cstring>
#include <memory>

namespace gsc {

namespace {

constexpr uint32_t kVersion = 4;
constexpr size_t kHeaderBytes = 32, kEntryBytes = 16, kPieceBytes = 1u << 18;
constexpr int kLevel = 12; // level that Niantic's own writer uses

struct Header {
    uint32_t magic, version, count;
    uint8_t degree, fraction, flags, streams;
    uint32_t toc; // byte offset in the file of the streams' sizes
    uint8_t reserved[12];
};
static_assert(sizeof(Header) == kHeaderBytes);

// Compresses bytes to a Zstandard frame, piece by piece.
class Frame {
public:
    explicit Frame(uint64_t raw_bytes) : m_context(ZSTD_createCCtx(), ZSTD_freeCCtx), m_piece(kPieceBytes)
    {
        if (m_context == nullptr)
            throw Error(ErrorCode::OutOfMemory, "zstd", "no memory", "1 MB", "close other programs");
        check(ZSTD_CCtx_setParameter(m_context.get(), ZSTD_c_compressionLevel, kLevel));
        // makes the frame state its size, which readers that unpack it at once ask for
        check(ZSTD_CCtx_setPledgedSrcSize(m_context.get(), raw_bytes));
    }

    void add(std::span<const uint8_t> bytes)
    {
        throwIfInterrupted();
        feed(bytes, ZSTD_e_continue);
    }
    std::vector<uint8_t> finish()
    {
        feed({}, ZSTD_e_end);
        return std::move(m_out);
    }

private:
    static void check(size_t result)
    {
        if (ZSTD_isError(result))
            throw Error(ErrorCode::OutOfMemory, "zstd", ZSTD_getErrorName(result), "memory for a frame",
                        "close other programs");
    }

    void feed(std::span<const uint8_t> bytes, ZSTD_EndDirective how)
    {
        ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
        size_t left = 1;
        while (left != 0) {
            ZSTD_outBuffer out{m_piece.data(), m_piece.size(), 0};
            left = ZSTD_compressStream2(m_context.get(), &out, &in, how);
            check(left);
            m_out.insert(m_out.end(), m_piece.begin(), m_piece.begin() + std::ptrdiff_t(out.pos));
            if (how == ZSTD_e_continue && in.pos == in.size)
                break;
        }
    }

    std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> m_context;
    std::vector<uint8_t> m_piece, m_out;
};

// Unpacks a frame and appends the result to `bytes`. Returns false unless it is exactly one frame of `raw_bytes` bytes.
// Memory grows with what was unpacked, not with the size that a header claims.
bool unpack(std::span<const std::byte> frame, uint64_t raw_bytes, std::vector<uint8_t>& bytes)
{
    const std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
    if (context == nullptr)
        throw Error(ErrorCode::OutOfMemory, "zstd", "no memory", "1 MB", "close other programs");
    std::vector<uint8_t> piece(kPieceBytes);
    ZSTD_inBuffer in{frame.data(), frame.size(), 0};
    uint64_t got = 0;
    size_t left = 1;
    while (left != 0) {
        ZSTD_outBuffer out{piece.data(), piece.size(), 0};
        left = ZSTD_decompressStream(context.get(), &out, &in);
        got += out.pos;
        if (ZSTD_isError(left) || got > raw_bytes || (left != 0 && in.pos == in.size && out.pos < out.size))
            return false;
        bytes.insert(bytes.end(), piece.begin(), piece.begin() + std::ptrdiff_t(out.pos));
    }
    return got == raw_bytes && in.pos == in.size;
}

} // namespace

void requireSpz4() {}

void writeSpz4(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write)
{
    std::vector<std::vector<uint8_t>> frames; // kept until all sizes are known, because these come first in the file
    std::vector<uint64_t> entries;
    const std::array<uint64_t, kSpzStreams> sizes = spzStreamBytes(header);
    for (size_t stream = 0; stream < kSpzStreams; ++stream) {
        if (sizes[stream] == 0)
            continue;
        Frame frame(sizes[stream]);
        pack(stream, [&frame](std::span<const uint8_t> bytes) { frame.add(bytes); });
        frames.push_back(frame.finish());
        entries.insert(entries.end(), {frames.back().size(), sizes[stream]});
    }
    const Header head{kSpzMagic,
                      kVersion,
                      header.count,
                      header.degree,
                      header.fraction,
                      0,
                      uint8_t(frames.size()),
                      uint32_t(kHeaderBytes),
                      {}};
    write(std::as_bytes(std::span(&head, 1)));
    write(std::as_bytes(std::span(entries)));
    for (const std::vector<uint8_t>& frame : frames)
        write(std::as_bytes(std::span(frame)));
}

SpzContent readSpz4(std::span<const std::byte> file, const std::string& name)
{
    const auto fail = [&name](const std::string& found, const std::string& expected) {
        throw Error(ErrorCode::InvalidFile, name, found, expected, "export it again");
    };
    Header head{};
    if (file.size() >= kHeaderBytes)
        std::memcpy(&head, file.data(), kHeaderBytes);
    if (head.magic != kSpzMagic || head.version != kVersion || head.degree > kMostShDegree)
        fail("no header of SPZ version 4", "one");
    SpzContent content{{head.count, head.degree, head.fraction}, {}};
    size_t entry = head.toc, at = entry + kEntryBytes * head.streams;
    if (entry < kHeaderBytes || at > file.size())
        fail(formatString("a table of %d streams at byte %u of %zu", int(head.streams), head.toc, file.size()),
             "it in the file");
    size_t left = head.streams;
    for (const uint64_t size : spzStreamBytes(content.header)) {
        if (size == 0)
            continue;
        uint64_t sizes[2] = {};
        if (left > 0)
            std::memcpy(sizes, file.data() + entry, kEntryBytes);
        if (left == 0 || sizes[1] != size || sizes[0] > file.size() - at ||
            !unpack(file.subspan(at, sizes[0]), size, content.bytes))
            fail(formatString("%u Gaussians of degree %d and a stream of %llu bytes", head.count, int(head.degree),
                              (unsigned long long)sizes[1]),
                 formatString("one whole frame of %llu", (unsigned long long)size));
        at += sizes[0];
        entry += kEntryBytes;
        --left;
    }
    if (left != 0 || at != file.size())
        fail(formatCount(file.size() - at, "byte") + " behind the streams", "none");
    return content;
}

} // namespace gsc
