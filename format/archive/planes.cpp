// SPDX-License-Identifier: Apache-2.0
#include "format/archive/codec.h"

#include <cstring>

namespace gsc {

namespace {

// Records of one step of the loops, so few that the bytes which all columns touch stay in the cache.
constexpr size_t kBlock = 512;

template <typename T>
void split(const std::byte* in, size_t records, uint32_t columns, std::byte* out)
{
    // bytes of one plane, and of one plane of every column: a value's next byte lies that far behind
    const size_t plane = records, group = records * columns;
    for (size_t first = 0; first < records; first += kBlock) {
        const size_t last = first + kBlock < records ? first + kBlock : records;
        for (uint32_t c = 0; c < columns; ++c) {
            std::byte* const to = out + c * plane;
            for (size_t i = first; i < last; ++i) {
                T value;
                std::memcpy(&value, in + (i * columns + c) * sizeof(T), sizeof(T));
                for (size_t b = 0; b < sizeof(T); ++b)
                    to[b * group + i] = std::byte(value >> (8 * b));
            }
        }
    }
}

template <typename T>
void join(const std::byte* in, size_t records, uint32_t columns, std::byte* out)
{
    const size_t plane = records, group = records * columns;
    for (size_t first = 0; first < records; first += kBlock) {
        const size_t last = first + kBlock < records ? first + kBlock : records;
        for (uint32_t c = 0; c < columns; ++c) {
            const std::byte* const from = in + c * plane;
            for (size_t i = first; i < last; ++i) {
                T value = 0;
                for (size_t b = 0; b < sizeof(T); ++b)
                    value = T(value | T(T(from[b * group + i]) << (8 * b)));
                std::memcpy(out + (i * columns + c) * sizeof(T), &value, sizeof(T));
            }
        }
    }
}

} // namespace

void splitPlanes(std::span<const std::byte> in, uint32_t element, uint32_t columns, std::byte* out)
{
    const size_t records = in.size() / (size_t(element) * columns);
    switch (element) {
    case 2:
        return split<uint16_t>(in.data(), records, columns, out);
    case 4:
        return split<uint32_t>(in.data(), records, columns, out);
    case 8:
        return split<uint64_t>(in.data(), records, columns, out);
    default:
        return split<uint8_t>(in.data(), records, columns, out);
    }
}

void joinPlanes(const std::byte* in, uint32_t element, uint32_t columns, std::span<std::byte> out)
{
    const size_t records = out.size() / (size_t(element) * columns);
    switch (element) {
    case 2:
        return join<uint16_t>(in, records, columns, out.data());
    case 4:
        return join<uint32_t>(in, records, columns, out.data());
    case 8:
        return join<uint64_t>(in, records, columns, out.data());
    default:
        return join<uint8_t>(in, records, columns, out.data());
    }
}

} // namespace gsc
