// SPDX-License-Identifier: Apache-2.0
#include "format/archive/steps.h"

#include <gsc/byte_view.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace gsc {

namespace {

constexpr int kLeastExponent = -126, kMostExponent = 127;
constexpr size_t kTriedRecords = 256; // records encoded first as a trial: they decide whether the rest is tried

struct Table {
    uint32_t columns = 0, span = 0;
    bool masks = false;
    size_t records = 0;

    // number of spans, each of which has one exponent
    [[nodiscard]] size_t spans() const { return records * (columns / span); }
    [[nodiscard]] size_t values() const { return records * columns; }
    [[nodiscard]] size_t maskBytes() const { return masks ? (values() / 3 + 7) / 8 : 0; }
};

bool isMasked(const uint8_t* masks, size_t value)
{
    const size_t bit = value / 3;
    return masks != nullptr && (masks[bit / 8] >> (bit % 8) & 1u) != 0;
}

// Indices of the spans sorted by exponent, stable; spans without a step (kNoStep) are left out.
std::vector<uint32_t> spansByExponent(std::span<const int8_t> exponents)
{
    std::array<size_t, 257> first{};
    for (const int8_t e : exponents)
        ++first[size_t(int(e) + 128) + 1];
    const size_t without = first[1];
    for (size_t i = 1; i < first.size(); ++i)
        first[i] += first[i - 1];
    std::vector<uint32_t> order(exponents.size() - without);
    for (uint32_t i = 0; i < exponents.size(); ++i)
        if (exponents[i] != kNoStep)
            order[first[size_t(int(exponents[i]) + 128)]++ - without] = i;
    return order;
}

// Exponent of the lowest mantissa bit that is set, of the float with these bits. Precondition: it is a normal number.
int lowestBit(uint32_t bits)
{
    const uint32_t mantissa = (bits & 0x7fffffu) | 0x800000u;
    return int(bits >> 23 & 0xffu) - 150 + std::countr_zero(mantissa);
}

bool isZero(uint32_t bits)
{
    return bits == 0;
}

// Returns true if the float is neither a normal number nor plus zero.
bool isOdd(uint32_t bits)
{
    const uint32_t exponent = bits >> 23 & 0xffu;
    return (exponent == 0 && bits != 0) || exponent == 0xffu;
}

class Encoder {
public:
    Encoder(const std::byte* raw, const Table& table) : m_raw(raw), m_table(table) {}

    // Finds masks, and the exponent of every span. Returns false if a value has no step.
    bool find()
    {
        m_exponents.resize(m_table.spans());
        m_masks.resize(m_table.maskBytes());
        for (size_t v = 0; m_table.masks && v < m_table.values(); v += 3)
            if (bits(v) == kMaskedOffset && bits(v + 1) == kMaskedOffset && bits(v + 2) == kMaskedOffset)
                m_masks[v / 3 / 8] = uint8_t(m_masks[v / 3 / 8] | 1u << (v / 3 % 8));
        for (size_t s = 0; s < m_table.spans(); ++s) {
            int least = kMostExponent + 1;
            for (size_t v = s * m_table.span; v < (s + 1) * m_table.span; ++v) {
                if (masked(v) || isZero(bits(v)))
                    continue;
                if (isOdd(bits(v)))
                    return false;
                least = std::min(least, lowestBit(bits(v)));
            }
            if (least < kLeastExponent)
                return false;
            m_exponents[s] = int8_t(least > kMostExponent ? kNoStep : least);
        }
        return true;
    }

    // Turns values into steps and counts the byte planes that these take. Returns false if a value takes more than
    // kMostStepPlanes.
    bool count()
    {
        uint32_t all = 0;
        for (const uint32_t s : spansByExponent(m_exponents))
            for (size_t v = size_t(s) * m_table.span; v < size_t(s + 1) * m_table.span; ++v) {
                if (masked(v))
                    continue;
                const uint32_t b = bits(v);
                uint32_t folded = 0;
                if (!isZero(b)) {
                    const uint32_t mantissa = (b & 0x7fffffu) | 0x800000u;
                    const int shift = int(b >> 23 & 0xffu) - 150 - int(m_exponents[s]);
                    if (shift > 0)
                        return false;
                    const uint32_t steps = mantissa >> -shift;
                    folded = steps * 2 - (b >> 31); // steps of 1, -1, 2, -2 ... are stored as 2, 1, 4, 3 ...
                }
                all |= folded;
                m_steps.push_back(folded);
            }
        m_planes = uint32_t(std::bit_width(all) + 7) / 8;
        return m_planes <= kMostStepPlanes;
    }

    void append(Coder& coder, std::vector<std::byte>& out) const
    {
        StepsHeader header{};
        header.span = m_table.span;
        header.masks = m_table.masks ? 1 : 0;
        header.planes = m_planes;
        const size_t at = out.size();
        out.resize(at + sizeof(header));
        const auto add = [&](const void* bytes, size_t count, uint32_t columns) {
            const size_t before = out.size();
            coder.encode({static_cast<const std::byte*>(bytes), count}, 1, columns, out);
            return out.size() - before;
        };
        header.exponent_bytes = add(m_exponents.data(), m_exponents.size(), m_table.columns / m_table.span);
        header.mask_bytes = add(m_masks.data(), m_masks.size(), 1);
        std::vector<uint8_t> plane(m_steps.size());
        for (uint32_t p = 0; p < m_planes; ++p) {
            for (size_t i = 0; i < plane.size(); ++i)
                plane[i] = uint8_t(m_steps[i] >> (8 * p));
            header.plane_bytes[p] = add(plane.data(), plane.size(), 1);
        }
        std::memcpy(out.data() + at, &header, sizeof(header));
    }

private:
    [[nodiscard]] uint32_t bits(size_t value) const
    {
        uint32_t b;
        std::memcpy(&b, m_raw + value * sizeof(b), sizeof(b));
        return b;
    }
    [[nodiscard]] bool masked(size_t value) const
    {
        return isMasked(m_masks.empty() ? nullptr : m_masks.data(), value);
    }

    const std::byte* m_raw;
    Table m_table;
    std::vector<int8_t> m_exponents;
    std::vector<uint8_t> m_masks;
    std::vector<uint32_t> m_steps;
    uint32_t m_planes = 0;
};

// Writes the values of all spans, which are stored sorted by the exponents of the spans.
void restore(const Table& table, std::span<const int8_t> exponents, const uint8_t* masks,
             std::span<const uint32_t> order, std::span<const uint8_t> planes, size_t count, std::byte* out)
{
    const uint8_t* const low = planes.data();
    const size_t plane_count = count > 0 ? planes.size() / count : 0;
    size_t next = 0;
    for (const uint32_t s : order) {
        const float step = std::bit_cast<float>(uint32_t(int(exponents[s]) + 127) << 23);
        for (size_t v = size_t(s) * table.span; v < size_t(s + 1) * table.span; ++v) {
            if (isMasked(masks, v))
                continue;
            uint32_t folded = plane_count > 0 ? low[next] : 0u;
            for (size_t p = 1; p < plane_count; ++p)
                folded |= uint32_t(low[p * count + next]) << (8 * p);
            ++next;
            const auto steps = int32_t((folded + 1) / 2);
            const float value = float(folded % 2 != 0 ? -steps : steps) * step;
            std::memcpy(out + v * sizeof(value), &value, sizeof(value));
        }
    }
}

} // namespace

bool encodeSteps(std::span<const std::byte> raw, uint32_t columns, uint32_t span, bool masks, Coder& coder,
                 std::vector<std::byte>& out)
{
    const Table table{columns, span, masks, raw.size() / (sizeof(float) * columns)};
    if (table.values() > UINT32_MAX)
        return false;
    Table some = table;
    some.records = std::min(table.records, kTriedRecords);
    if (Encoder tried(raw.data(), some); !tried.find() || !tried.count())
        return false;
    Encoder encoder(raw.data(), table);
    if (!encoder.find() || !encoder.count())
        return false;
    encoder.append(coder, out);
    return true;
}

bool decodeSteps(std::span<const std::byte> stored, uint32_t columns, Coder& coder, std::span<std::byte> out)
{
    const ByteView view(stored);
    const auto header = view.load<StepsHeader>(0);
    if (!header || header->span < 1 || columns % header->span != 0 || header->masks > 1 || header->reserved != 0 ||
        (header->masks != 0 && columns % 3 != 0) || header->planes > kMostStepPlanes)
        return false;
    const Table table{columns, header->span, header->masks != 0, out.size() / (sizeof(float) * columns)};
    if (table.values() > UINT32_MAX)
        return false;
    uint64_t at = sizeof(StepsHeader);
    const auto piece = [&](uint64_t bytes, uint32_t record, std::span<std::byte> to) {
        const auto from = view.slice(at, bytes);
        at += from ? bytes : 0;
        return from && coder.decode(bytes == to.size() ? Codec::Raw : Codec::Zstd, *from, 1, record, to);
    };
    std::vector<int8_t> exponents(table.spans());
    std::vector<uint8_t> masks(table.maskBytes());
    if (!piece(header->exponent_bytes, columns / header->span, std::as_writable_bytes(std::span(exponents))) ||
        !piece(header->mask_bytes, 1, std::as_writable_bytes(std::span(masks))))
        return false;
    const uint8_t* const masked = masks.empty() ? nullptr : masks.data();
    // sets the masked values, which no plane holds; other values without a step are zero already
    for (size_t v = 0; masked != nullptr && v < table.values(); ++v)
        if (isMasked(masked, v))
            std::memcpy(out.data() + v * sizeof(float), &kMaskedOffset, sizeof(float));
    for (const int8_t e : exponents)
        if (e != kNoStep && e < kLeastExponent)
            return false;
    const std::vector<uint32_t> order = spansByExponent(exponents);
    size_t count = 0;
    for (const uint32_t s : order)
        for (size_t v = size_t(s) * table.span; v < size_t(s + 1) * table.span; ++v)
            count += isMasked(masked, v) ? 0 : 1;
    std::vector<uint8_t> planes(count * header->planes);
    for (uint32_t p = 0; p < kMostStepPlanes; ++p) {
        const bool there = p < header->planes;
        if (there
                ? !piece(header->plane_bytes[p], 1, std::as_writable_bytes(std::span(planes)).subspan(count * p, count))
                : header->plane_bytes[p] != 0)
            return false;
    }
    if (at != stored.size())
        return false;
    restore(table, exponents, masked, order, planes, count, out.data());
    return true;
}

} // namespace gsc
