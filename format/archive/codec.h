// SPDX-License-Identifier: Apache-2.0
// Codecs of archives (archive_layout.h): they turn bytes into fewer bytes and back. The decoders trust no stored byte.
#pragma once

#include <gsc/archive_layout.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gsc {

// Returns true if this build can decode `codec` (Zstd needs GSC_WITH_ZSTD), false for an unknown one.
[[nodiscard]] bool hasCodec(Codec codec);
[[nodiscard]] const char* codecName(Codec codec); // name for messages, "?" for an unknown codec

// Reorders records of `columns` values, each of `element` bytes, into byte planes: first the lowest byte of every
// record's first value, then of every record's second value, and so on, last the highest byte of every record's last
// value. `in` holds whole records; `out` has as many bytes.
void splitPlanes(std::span<const std::byte> in, uint32_t element, uint32_t columns, std::byte* out);
void joinPlanes(const std::byte* in, uint32_t element, uint32_t columns, std::span<std::byte> out);

// Encodes and decodes. Keeps the memory of the Zstandard library from call to call; each thread needs an object of its
// own.
class Coder {
public:
    explicit Coder(int level = 0); // `level`: compression level of Zstandard, for encoding only
    ~Coder();
    Coder(Coder&&) noexcept;
    Coder& operator=(Coder&&) noexcept;

    // Encodes `raw` as Zstd and as Raw and appends the smaller of the two to `out`; returns true if that is Zstd.
    bool encode(std::span<const std::byte> raw, uint32_t element, uint32_t columns, std::vector<std::byte>& out);
    // Decodes `stored` into `out`. Returns false if `stored` is no result of encode() for as many bytes as `out` has.
    // Precondition: `element` is 1, 2, 4 or 8 and `out` is whole records.
    bool decode(Codec codec, std::span<const std::byte> stored, uint32_t element, uint32_t columns,
                std::span<std::byte> out);

private:
    struct State;
    std::unique_ptr<State> m_state;
};

} // namespace gsc
