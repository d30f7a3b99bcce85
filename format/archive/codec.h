// SPDX-License-Identifier: Apache-2.0
// The codecs of archives (archive_layout.h): bytes to fewer bytes and back. Nothing that is decoded is trusted.
#pragma once

#include <gsc/archive_layout.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gsc {

// Whether this build can decode the codec (GSC_WITH_ZSTD). False for an unknown one.
[[nodiscard]] bool hasCodec(Codec codec);
[[nodiscard]] const char* codecName(Codec codec); // "?" for an unknown one

// Values of `element` bytes in records of `columns` of them -> planes: the lowest byte of every record's first value,
// then of every record's second, and so on to the highest byte of the last. `in` is whole records; `out` as long.
void splitPlanes(std::span<const std::byte> in, uint32_t element, uint32_t columns, std::byte* out);
void joinPlanes(const std::byte* in, uint32_t element, uint32_t columns, std::span<std::byte> out);

// Keeps the library's memory from call to call; one per thread.
class Coder {
public:
    explicit Coder(int level = 0); // `level`: compression level of Zstandard, for encoding only
    ~Coder();
    Coder(Coder&&) noexcept;
    Coder& operator=(Coder&&) noexcept;

    // Appends the smaller of Zstd and Raw to `out`; true if that is Zstd.
    bool encode(std::span<const std::byte> raw, uint32_t element, uint32_t columns, std::vector<std::byte>& out);
    // Returns false if `stored` is no result of encode() for as many bytes as `out` has. Precondition: `element` is 1,
    // 2, 4 or 8 and `out` is whole records.
    bool decode(Codec codec, std::span<const std::byte> stored, uint32_t element, uint32_t columns,
                std::span<std::byte> out);

private:
    struct State;
    std::unique_ptr<State> m_state;
};

} // namespace gsc
