// SPDX-License-Identifier: Apache-2.0
// Decodes rows of a PLY, one per anchor, into the arrays of an AnchorBatch.
#include "format/numbers/count_text.h"
#include "convert/input/ply_reader.h"

#include <gsc/error.h>

#include <charconv>
#include <cstring>

namespace gsc {

namespace {

// logit(0.1), the opacity before the sigmoid: the trainers store this value in every anchor, and a model without an
// opacity column was trained with it.
constexpr float kDefaultOpacity = -2.1972246f;

[[noreturn]] void throwMissing(const std::string& name, const std::string& text)
{
    throw Error(ErrorCode::InvalidFile, name, text, "the columns of a Scaffold-GS or Octree-GS anchor",
                "pass the point_cloud.ply that the trainer wrote");
}

uint32_t floatColumn(const PlyHeader& header, const std::string& column, const std::string& name)
{
    const PlyColumn* found = header.find(column);
    if (!found)
        throwMissing(name, "column '" + column + "' is missing");
    // other programs write integer columns, and the trainers' loaders read them; this reader does not
    if (!found->is_float)
        throw Error(ErrorCode::Unsupported, name, "column '" + column + "' is not float32",
                    "it as the trainers write it", "pass the point_cloud.ply that the trainer wrote");
    return found->offset;
}

// Byte offsets in a row of the columns <prefix>0, <prefix>1 and so on, by number, whatever their order in the file.
std::vector<uint32_t> numberedColumns(const PlyHeader& header, const std::string& prefix, const std::string& name)
{
    size_t count = 0;
    for (const PlyColumn& column : header.columns)
        if (column.name.starts_with(prefix)) {
            const char* end = column.name.data() + column.name.size();
            uint32_t number = 0;
            const auto parsed = std::from_chars(column.name.data() + prefix.size(), end, number);
            if (parsed.ec != std::errc() || parsed.ptr != end)
                throwMissing(name, "column '" + column.name + "' has no number");
            ++count;
        }
    std::vector<uint32_t> offsets;
    offsets.reserve(count);
    for (size_t i = 0; i < count; ++i)
        offsets.push_back(floatColumn(header, prefix + std::to_string(i), name));
    return offsets;
}

std::vector<uint32_t> optionalColumns(const PlyHeader& header, std::initializer_list<const char*> columns,
                                      const std::string& name)
{
    std::vector<uint32_t> offsets;
    if (header.find(*columns.begin()))
        for (const char* column : columns)
            offsets.push_back(floatColumn(header, column, name));
    return offsets;
}

float load(const std::byte* row, uint32_t offset)
{
    float value;
    std::memcpy(&value, row + offset, sizeof(value)); // memcpy, because rows have no alignment
    return value;
}

// Returns true if the float columns at these offsets lie side by side, as in every file that the trainers write.
bool contiguous(const std::vector<uint32_t>& offsets)
{
    for (size_t i = 1; i < offsets.size(); ++i)
        if (offsets[i] != offsets[0] + i * sizeof(float))
            return false;
    return true;
}

struct Rows {
    const std::byte* first;
    uint32_t bytes;
    size_t count;
};

void copyColumns(const Rows& rows, const std::vector<uint32_t>& offsets, float* out)
{
    const size_t width = offsets.size();
    const std::byte* row = rows.first;
    if (contiguous(offsets)) {
        for (size_t i = 0; i < rows.count; ++i, row += rows.bytes, out += width)
            std::memcpy(out, row + offsets[0], width * sizeof(float));
        return;
    }
    for (size_t i = 0; i < rows.count; ++i, row += rows.bytes, out += width)
        for (size_t c = 0; c < width; ++c)
            out[c] = load(row, offsets[c]);
}

void copyLevels(const Rows& rows, const std::vector<uint32_t>& offsets, uint64_t first_row, int32_t* level,
                const std::string& name)
{
    const std::byte* row = rows.first;
    for (size_t i = 0; i < rows.count; ++i, row += rows.bytes) {
        const float value = load(row, offsets[0]);
        // the comparison is written so that NaN is refused; the conversion to an integer truncates as the trainers'
        // loader does
        if (!(value > -1.0f && value < float(kMaxAnchorLevel + 1)))
            throw Error(ErrorCode::InvalidFile, name,
                        formatString("level of vertex %llu is %g", static_cast<unsigned long long>(first_row + i),
                                     double(value)),
                        formatString("0 to %d", kMaxAnchorLevel), "the file is damaged, copy it again");
        level[i] = int32_t(value);
    }
}

// One field of an anchor: the columns that hold it in the file, its array in a batch, and its value if the file lacks
// the columns.
struct Field {
    bool is_placement;
    std::vector<float> AnchorBatch::*values;
    std::vector<uint32_t> AnchorColumns::*columns;
    size_t missing_width = 0;
    float missing = 0;

    [[nodiscard]] bool isIn(uint32_t fields) const { return is_placement || fields == kAnchorAll; }
    [[nodiscard]] size_t width(const AnchorColumns& found) const
    {
        return (found.*columns).empty() ? missing_width : (found.*columns).size();
    }
};

constexpr Field kFields[] = {
    {true, &AnchorBatch::position, &AnchorColumns::position},
    {true, &AnchorBatch::extra_level, &AnchorColumns::extra_level, 1},
    {false, &AnchorBatch::offset, &AnchorColumns::offset},
    {false, &AnchorBatch::feature, &AnchorColumns::feature},
    {false, &AnchorBatch::scale, &AnchorColumns::scale},
    {false, &AnchorBatch::rotation, &AnchorColumns::rotation},
    {false, &AnchorBatch::opacity, &AnchorColumns::opacity, 1, kDefaultOpacity},
    {false, &AnchorBatch::normal, &AnchorColumns::normal, 3},
};

} // namespace

AnchorColumns findAnchorColumns(const PlyHeader& header, const std::string& name)
{
    AnchorColumns columns;
    columns.position = {floatColumn(header, "x", name), floatColumn(header, "y", name), floatColumn(header, "z", name)};
    const std::vector<uint32_t> offsets = numberedColumns(header, "f_offset_", name);
    columns.feature = numberedColumns(header, "f_anchor_feat_", name);
    columns.scale = numberedColumns(header, "scale_", name);
    columns.rotation = numberedColumns(header, "rot_", name);
    columns.normal = optionalColumns(header, {"nx", "ny", "nz"}, name);
    columns.level = optionalColumns(header, {"level"}, name);
    if (!columns.level.empty())
        columns.extra_level = {floatColumn(header, "extra_level", name)};
    columns.opacity = optionalColumns(header, {"opacity"}, name);
    columns.info = optionalColumns(header, {"info"}, name);
    if (!columns.info.empty() && columns.level.empty())
        throwMissing(name, "column 'info' is there, but column 'level' is missing");
    if (offsets.empty() || offsets.size() % 3 != 0)
        throwMissing(name, formatCount(offsets.size(), "column") + " f_offset_<n>, a multiple of 3 is needed");
    // Offsets lie in the file with the axis outermost (column axis * K + k), everywhere else with the Gaussian
    // outermost (3 k + axis).
    const size_t k_count = offsets.size() / 3;
    for (size_t i = 0; i < offsets.size(); ++i)
        columns.offset.push_back(offsets[i % 3 * k_count + i / 3]);
    if (columns.feature.empty())
        throwMissing(name, "no columns f_anchor_feat_<n>");
    if (columns.scale.size() != 6)
        throwMissing(name, formatCount(columns.scale.size(), "column") + " scale_<n>, 6 are needed");
    if (columns.rotation.size() != 4)
        throwMissing(name, formatCount(columns.rotation.size(), "column") +
                               " rot_<n>, 4 are needed (the SIBR viewer's crop tool loses them)");
    return columns;
}

void sizeBatch(AnchorBatch& batch, const AnchorColumns& columns, uint32_t fields, size_t count)
{
    batch.count = count;
    batch.level.resize(count);
    for (const Field& field : kFields)
        (batch.*field.values).resize(field.isIn(fields) ? count * field.width(columns) : 0);
}

void decodeAnchorRows(std::span<const std::byte> bytes, uint32_t row_bytes, const AnchorColumns& columns,
                      uint32_t fields, uint64_t first_row, AnchorBatch& batch, size_t at, const std::string& name)
{
    const Rows rows{bytes.data(), row_bytes, bytes.size() / row_bytes};
    if (!columns.level.empty())
        copyLevels(rows, columns.level, first_row, batch.level.data() + at, name);
    else
        std::fill_n(batch.level.begin() + std::ptrdiff_t(at), rows.count, 0);
    for (const Field& field : kFields) {
        if (!field.isIn(fields))
            continue;
        const size_t width = field.width(columns);
        float* out = (batch.*field.values).data() + width * at;
        if (const std::vector<uint32_t>& from = columns.*field.columns; !from.empty())
            copyColumns(rows, from, out);
        else
            std::fill_n(out, width * rows.count, field.missing);
    }
}

} // namespace gsc
