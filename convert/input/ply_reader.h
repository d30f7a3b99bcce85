// SPDX-License-Identifier: Apache-2.0
// Reads the trainers' PLY files: binary little-endian, one row of numbers per anchor.
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
    uint32_t offset; // in bytes, from the start of a row
    bool is_float;   // type float or float32
};

struct PlyHeader {
    uint64_t header_bytes = 0;
    uint64_t row_count = 0;
    uint32_t row_bytes = 0;
    std::vector<PlyColumn> columns;    // in the order of the file; names are unique
    std::vector<std::string> obj_info; // text of each obj_info line behind that word

    [[nodiscard]] const PlyColumn* find(std::string_view name) const;
};

constexpr size_t kMaxPlyHeader = 1u << 20;

// Parses the header of a PLY. `bytes`: the start of the file, all of it or at least kMaxPlyHeader bytes; `file_bytes`:
// size of the file. Checks that the file has exactly row_count rows, or more data if other elements follow. Throws
// Error: InvalidFile, Unsupported (ascii, big-endian, lists, other elements before the vertices).
PlyHeader parsePlyHeader(std::span<const std::byte> bytes, uint64_t file_bytes, const std::string& name);

// Columns of each field of an anchor: byte offsets in a row, in the order of the numbers at the end of the column
// names.
struct AnchorColumns {
    std::vector<uint32_t> position; // byte offsets of the 3 columns x, y, z
    std::vector<uint32_t> offset;   // byte offsets of 3 K columns; index 3 k + axis
    std::vector<uint32_t> feature;  // byte offsets of F columns
    std::vector<uint32_t> scale;    // byte offsets of 6 columns
    std::vector<uint32_t> rotation; // byte offsets of 4 columns: w, x, y, z
    std::vector<uint32_t> normal;   // byte offsets of 3 columns; empty if the file has no normals
    // one byte offset each; both are empty in a file without levels
    std::vector<uint32_t> level, extra_level;
    std::vector<uint32_t> opacity; // one byte offset; empty if the file has no such column
    std::vector<uint32_t> info;    // one byte offset; empty if the file has no such column
};

// Finds the columns of an anchor. Throws Error: InvalidFile where a column is missing or the numbers have a gap,
// Unsupported where a column is not float32.
AnchorColumns findAnchorColumns(const PlyHeader& header, const std::string& name);

constexpr int32_t kMaxAnchorLevel = int32_t(kMaxLevels) - 1;

// Decodes rows of the PLY into the anchors of `batch` from index `at` on. `first_row`: number of the first row, for
// messages. The vectors of `batch` must be large enough (sizeBatch()). Throws Error(InvalidFile) for a level outside
// 0..kMaxAnchorLevel.
void decodeAnchorRows(std::span<const std::byte> rows, uint32_t row_bytes, const AnchorColumns& columns,
                      uint32_t fields, uint64_t first_row, AnchorBatch& batch, size_t at, const std::string& name);

// Makes the vectors of `batch` large enough for `count` anchors; those not named in `fields` (AnchorFields) become
// empty.
void sizeBatch(AnchorBatch& batch, const AnchorColumns& columns, uint32_t fields, size_t count);

// A PLY file on disk. Its rows are read on demand.
class PlyFile {
public:
    explicit PlyFile(const std::string& path); // throws as parsePlyHeader() and InputFile do

    [[nodiscard]] const PlyHeader& header() const { return m_header; }
    [[nodiscard]] const std::string& path() const { return m_file.path(); }
    // Reads out.size() / row_bytes rows from row `first` on. The caller must not ask for rows beyond row_count.
    void readRows(uint64_t first, std::span<std::byte> out) const;
    void prefetchRows(uint64_t first, uint64_t count) const noexcept;

private:
    InputFile m_file;
    PlyHeader m_header;
};

} // namespace gsc
