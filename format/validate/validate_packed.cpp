// SPDX-License-Identifier: Apache-2.0
// Checks MLPP: shapes that follow from the parameters, arrays that lie in the section, and values that equal those of
// MLPW.
#include <gsc/half.h>
#include "format/validate/validate_regions.h"

#include <bit>
#include <cstddef>

namespace gsc::validate {

namespace {

struct PackedRegion {
    const char* name;
    uint64_t offset, count;
    size_t value_bytes;
    size_t field;
};

std::vector<PackedRegion> packedRegions(const PackedMlpHeader& h)
{
    const uint64_t columns = 3 * uint64_t(h.hidden_pad);
    std::vector<PackedRegion> regions = {
        {"first_f32", h.first_f32, h.in_rows * columns, 4, offsetof(PackedMlpHeader, first_f32)},
        {"first_bias_f32", h.first_bias_f32, columns, 4, offsetof(PackedMlpHeader, first_bias_f32)},
        {"first_f16", h.first_f16, h.k_pad * columns, 2, offsetof(PackedMlpHeader, first_f16)},
    };
    for (uint32_t i = 0; i < 3; ++i) {
        const uint64_t count = uint64_t(h.hidden_pad) * h.out_pad[i];
        regions.push_back({"second_f32", h.second_f32[i], count, 4, offsetof(PackedMlpHeader, second_f32) + 8 * i});
        regions.push_back({"second_bias_f32", h.second_bias_f32[i], h.out_pad[i], 4,
                           offsetof(PackedMlpHeader, second_bias_f32) + 8 * i});
        regions.push_back({"second_f16", h.second_f16[i], count, 2, offsetof(PackedMlpHeader, second_f16) + 8 * i});
    }
    return regions;
}

// Index of the first half that is not finite (whose five exponent bits are all ones), or values.size().
size_t finiteHalfPrefix(std::span<const uint16_t> values)
{
    return size_t(std::find_if(values.begin(), values.end(), [](uint16_t v) { return (v & 0x7c00u) == 0x7c00u; }) -
                  values.begin());
}

bool checkPackedShape(Context& context, const PackedMlpHeader& h, uint64_t at)
{
    IssueLog& log = context.log;
    const ModelParams& p = *context.view.params;
    const uint64_t before = log.errors();
    const auto shape = [&](const char* name, size_t offset, uint32_t value, uint64_t expected) {
        if (value != expected)
            GSC_REPORT(log, PackedShape, at + offset, formatString("/packed/%s", name), name, value,
                       unsigned(expected));
    };
    shape("in_rows", offsetof(PackedMlpHeader, in_rows), h.in_rows, p.feat_dim + 5 + p.appearance_dim);
    shape("hidden_pad", offsetof(PackedMlpHeader, hidden_pad), h.hidden_pad, alignUp(p.feat_dim, 16));
    shape("k_pad", offsetof(PackedMlpHeader, k_pad), h.k_pad, alignUp(p.feat_dim + 5, 16));
    const uint32_t out[] = {p.n_offsets, 7 * p.n_offsets, 3 * p.n_offsets};
    for (uint32_t i = 0; i < 3; ++i)
        shape("out_pad", offsetof(PackedMlpHeader, out_pad) + 4 * i, h.out_pad[i], alignUp(out[i], 16));
    return log.errors() == before;
}

// Row of the fused first layer (PackedMlpHeader) for input `i` of a head.
uint32_t fusedRow(const MlpRecord& mlp, uint32_t feat_dim, uint32_t i)
{
    if (i < feat_dim + 3)
        return i;
    i -= feat_dim + 3;
    if (mlp.inputs & kMlpTakesDistance) {
        if (i == 0)
            return feat_dim + 3;
        --i;
    }
    if (mlp.inputs & kMlpTakesLevel) {
        if (i == 0)
            return feat_dim + 4;
        --i;
    }
    return feat_dim + 5 + i;
}

// Returns true if `half` is the one nearest to `weight`, or the largest finite one if `weight` is beyond that.
bool matchesHalf(float weight, uint16_t half)
{
    constexpr float kMaxHalf = 65504;
    const float value = halfToFloat(half);
    const float clamped = std::clamp(weight, -kMaxHalf, kMaxHalf);
    return std::fabs(value - clamped) <= std::max(std::fabs(clamped) * 0x1p-11f, 0x1p-25f);
}

class ContentCheck {
public:
    ContentCheck(Context& context, const PackedMlpHeader& header)
        : m_context(context), m_header(header), m_packed(context.view.packed), m_weights(context.view.weights)
    {
    }

    void run()
    {
        const ModelParams& p = *m_context.view.params;
        const uint32_t columns = 3 * m_header.hidden_pad;
        std::vector<float> first(size_t(m_header.in_rows) * columns), bias(columns);
        for (uint32_t h = 0; h < 3; ++h) {
            const MlpRecord& mlp = m_context.view.mlps[h];
            const auto weight0 = canonical(mlp.weight0, uint64_t(mlp.hidden) * mlp.in);
            const auto bias0 = canonical(mlp.bias0, mlp.hidden);
            for (uint32_t o = 0; o < mlp.hidden; ++o) {
                const uint32_t column = h * m_header.hidden_pad + o;
                for (uint32_t i = 0; i < mlp.in; ++i)
                    first[size_t(fusedRow(mlp, p.feat_dim, i)) * columns + column] = weight0[size_t(o) * mlp.in + i];
                bias[column] = bias0[o];
            }
            runSecond(mlp, h);
        }
        compareFloats("first_f32", m_header.first_f32, first);
        compareFloats("first_bias_f32", m_header.first_bias_f32, bias);
        // the half-precision copy has no rows for the appearance; it is padded with rows of zeros
        first.resize(size_t(p.feat_dim + 5) * columns);
        first.resize(size_t(m_header.k_pad) * columns);
        compareHalves("first_f16", m_header.first_f16, first, columns);
    }

private:
    [[nodiscard]] std::span<const float> canonical(uint64_t offset, uint64_t count) const
    {
        return m_weights.array<float>(offset, count).value();
    }

    void runSecond(const MlpRecord& mlp, uint32_t h)
    {
        const uint32_t columns = m_header.out_pad[h];
        std::vector<float> second(size_t(m_header.hidden_pad) * columns), bias(columns);
        const auto weight1 = canonical(mlp.weight1, uint64_t(mlp.out) * mlp.hidden);
        const auto bias1 = canonical(mlp.bias1, mlp.out);
        for (uint32_t o = 0; o < mlp.out; ++o) {
            for (uint32_t i = 0; i < mlp.hidden; ++i)
                second[size_t(i) * columns + o] = weight1[size_t(o) * mlp.hidden + i];
            bias[o] = bias1[o];
        }
        compareFloats("second_f32", m_header.second_f32[h], second);
        compareFloats("second_bias_f32", m_header.second_bias_f32[h], bias);
        compareHalves("second_f16", m_header.second_f16[h], second, columns);
    }

    void report(const char* name, uint64_t offset, uint64_t index, float found, float expected)
    {
        GSC_REPORT(m_context.log, PackedContent, m_context.offsetOf(kSectionPacked) + offset,
                   formatString("/packed/%s", name), index, name, double(found), double(expected));
    }

    void compareFloats(const char* name, uint64_t offset, std::span<const float> expected)
    {
        const auto found = m_packed.array<float>(offset, expected.size()).value();
        for (size_t i = 0; i < expected.size(); ++i)
            if (std::bit_cast<uint32_t>(found[i]) != std::bit_cast<uint32_t>(expected[i]))
                report(name, offset + 4 * i, i, found[i], expected[i]);
    }

    // Compares the halves at `offset` with `expected`, row-major, `columns` wide and made of whole tiles of 16 x 8.
    void compareHalves(const char* name, uint64_t offset, std::span<const float> expected, uint32_t columns)
    {
        const auto found = m_packed.array<uint16_t>(offset, expected.size()).value();
        const uint32_t column_tiles = columns / 8;
        for (size_t i = 0; i < expected.size(); ++i) {
            const size_t half = i % 4, lane = i / 4 % 32, tile = i / 128;
            const size_t row = tile / column_tiles * 16 + 2 * (lane % 4) + half % 2 + half / 2 * 8;
            const float weight = expected[row * columns + tile % column_tiles * 8 + lane / 4];
            if (!matchesHalf(weight, found[i]))
                report(name, offset + 2 * i, i, halfToFloat(found[i]), weight);
        }
    }

    Context& m_context;
    const PackedMlpHeader& m_header;
    ByteView m_packed, m_weights;
};

} // namespace

bool checkPacked(Context& context)
{
    IssueLog& log = context.log;
    const ByteView section(context.view.packed);
    const uint64_t at = context.offsetOf(kSectionPacked);
    // MLPP is present and this long, since bindSections() has checked that
    const PackedMlpHeader header = section.load<PackedMlpHeader>(0).value();
    for (uint32_t i = 0; i < std::size(header.reserved); ++i)
        if (header.reserved[i] != 0)
            GSC_REPORT(log, PackedReserved, at + offsetof(PackedMlpHeader, reserved) + 8 * i, "/packed/reserved", i,
                       header.reserved[i]);
    if (!checkPackedShape(context, header, at))
        return false;
    const uint64_t before = log.errors();
    std::vector<Region> regions;
    for (const PackedRegion& region : packedRegions(header)) {
        const std::string pointer = formatString("/packed/%s", region.name);
        const uint64_t bytes = region.count * region.value_bytes;
        if (region.offset % 256 != 0)
            GSC_REPORT(log, PackedAlign, at + region.field, pointer, region.name, region.offset);
        if (region.offset < sizeof(PackedMlpHeader) || !section.contains(region.offset, bytes)) {
            GSC_REPORT(log, PackedRange, at + region.field, pointer, region.name, bytes, region.offset, section.size());
            continue;
        }
        regions.push_back({region.offset, bytes, pointer});
        uint64_t good = region.count;
        if (region.value_bytes == 4) {
            if (const auto values = section.array<float>(region.offset, region.count))
                good = finitePrefix(*values);
        } else if (const auto values = section.array<uint16_t>(region.offset, region.count)) {
            good = finiteHalfPrefix(*values);
        }
        if (good != region.count)
            GSC_REPORT(log, PackedValue, at + region.offset + good * region.value_bytes, pointer, good, region.name);
    }
    checkOverlaps(regions, [&](const Region& region, const Region& other) {
        GSC_REPORT(log, PackedOverlap, at + region.offset, region.pointer, region.offset, other.offset);
    });
    return log.errors() == before;
}

void checkPackedContent(Context& context)
{
    const PackedMlpHeader header = ByteView(context.view.packed).load<PackedMlpHeader>(0).value();
    ContentCheck(context, header).run();
}

} // namespace gsc::validate
