// SPDX-License-Identifier: Apache-2.0
// The PLY files of the trainers: an element of scalar columns, binary little-endian, one row per anchor.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/input/input_file.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct PlyColumn {
    std::string name;
    uint32_t offset; // bytes from the start of a row
    bool is_float;   // float or float32
};

struct PlyHeader {
    uint64_t header_bytes = 0;
    uint64_t row_count = 0;
    uint32_t row_bytes = 0;
    std::vector<PlyColumn> columns;    // in file order, names unique
    std::vector<std::string> obj_info; // text after the keyword

    [[nodiscard]] const PlyColumn* find(std::string_view name) const;
};

constexpr size_t kMaxPlyHeader = 1u << 20;

// `bytes` are the first of the file, all of it or at least kMaxPlyHeader; `file_bytes` its size. The body is checked
// to hold exactly row_count rows, and maybe other elements behind them. Throws Error: InvalidFile, Unsupported (ascii,
// big-endian, lists, other elements before the vertices).
PlyHeader parsePlyHeader(std::span<const std::byte> bytes, uint64_t file_bytes, const std::string& name);

// Offsets of an anchor's fields in a row, bytes, in the order of the number at the end of their names.
struct AnchorColumns {
    std::vector<uint32_t> position;           // 3
    std::vector<uint32_t> offset;             // 3 K, k-major: 3 k + axis
    std::vector<uint32_t> feature;            // F
    std::vector<uint32_t> scale;              // 6
    std::vector<uint32_t> rotation;           // 4
    std::vector<uint32_t> normal;             // 3 or none
    std::vector<uint32_t> level, extra_level; // 1 or none, both or neither
    std::vector<uint32_t> opacity;            // 1 or none
    std::vector<uint32_t> info;               // 1 or none
};

// Throws Error: InvalidFile where a column is missing or numbered with a gap, Unsupported where it is not float32.
AnchorColumns findAnchorColumns(const PlyHeader& header, const std::string& name);

constexpr int32_t kMaxAnchorLevel = int32_t(kMaxLevels) - 1;

// Decodes rows that lie one after another in `rows` into `batch`, from its anchor `at` on. The vectors of `batch` must
// have room (see sizeBatch()); `first_row` is the number of the first, for messages. Throws Error(InvalidFile) for a
// level outside 0..kMaxAnchorLevel.
void decodeAnchorRows(std::span<const std::byte> rows, uint32_t row_bytes, const AnchorColumns& columns,
                      uint32_t fields, uint64_t first_row, AnchorBatch& batch, size_t at, const std::string& name);

// Sets the sizes of the vectors of `batch` for `count` anchors of `fields` (AnchorFields); the others become empty.
void sizeBatch(AnchorBatch& batch, const AnchorColumns& columns, uint32_t fields, size_t count);

// A PLY file on disk; the body is never held in memory.
class PlyFile {
public:
    explicit PlyFile(const std::string& path); // throws as parsePlyHeader() and InputFile do

    [[nodiscard]] const PlyHeader& header() const { return m_header; }
    [[nodiscard]] const std::string& path() const { return m_file.path(); }
    // Rows [first, first + out.size() / row_bytes); the caller keeps them inside the file.
    void readRows(uint64_t first, std::span<std::byte> out) const;
    void prefetchRows(uint64_t first, uint64_t count) const noexcept;

private:
    InputFile m_file;
    PlyHeader m_header;
};

} // namespace gsc
