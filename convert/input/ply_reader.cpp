// SPDX-License-Identifier: Apache-2.0
#include "convert/input/ply_reader.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"

#include <algorithm>
#include <charconv>
#include <unordered_map>
#include <unordered_set>

namespace gsc {

namespace {

constexpr size_t kMaxColumns = 8192;

constexpr const char* kTakeTrainers = "pass the point_cloud.ply that the trainer wrote";

[[noreturn]] void throwInvalid(const std::string& name, const std::string& found, const char* expected,
                               const char* remedy = kTakeTrainers)
{
    throw Error(ErrorCode::InvalidFile, name, found, expected, remedy);
}

// Throws for a valid PLY that we do not read.
[[noreturn]] void throwUnsupported(const std::string& name, const std::string& found, const char* expected)
{
    throw Error(ErrorCode::Unsupported, name, found, expected, kTakeTrainers);
}

// Throws for a file written by the crop tool of the SIBR viewer: it lacks `end_header` and the rotation columns, and
// its scales are no longer logarithms, so nothing in it can be used.
[[noreturn]] void throwNoEnd(const std::string& name)
{
    throwInvalid(name, "header has no 'end_header'", "one",
                 "a PLY saved by the SIBR viewer's crop tool looks like this and has lost its rotations and scales");
}

std::vector<std::string_view> words(std::string_view line)
{
    std::vector<std::string_view> result;
    for (size_t i = 0; i < line.size();) {
        const size_t end = std::min(line.find_first_of(" \t", i), line.size());
        if (end > i)
            result.push_back(line.substr(i, end - i));
        i = end + 1;
    }
    return result;
}

// The words of a header line behind the first, with the spaces between them.
std::string rest(const std::vector<std::string_view>& line)
{
    return line.size() < 2
               ? std::string()
               : std::string(line[1].data(), size_t(line.back().data() + line.back().size() - line[1].data()));
}

// Size in bytes of each scalar type of a PLY.
const std::unordered_map<std::string_view, uint32_t> kScalarBytes = {
    {"char", 1},   {"int8", 1},    {"uchar", 1},  {"uint8", 1},  {"short", 2}, {"int16", 2},
    {"ushort", 2}, {"uint16", 2},  {"int", 4},    {"int32", 4},  {"uint", 4},  {"uint32", 4},
    {"float", 4},  {"float32", 4}, {"double", 8}, {"float64", 8}};

std::string clip(std::string_view text)
{
    std::string result;
    for (const char c : text.substr(0, 60))
        result += c >= ' ' && c <= '~' ? c : '?';
    return result;
}

void checkFormat(const std::vector<std::string_view>& line, const std::string& name)
{
    const std::string found = line.size() > 1 ? std::string(line[1]) : "";
    if (found == "ascii" || found == "binary_big_endian")
        throw Error(ErrorCode::Unsupported, name, "format is " + found, "binary_little_endian as the trainers write it",
                    "convert the file, for example with plyfile");
    if (line.size() != 3 || line[0] != "format" || found != "binary_little_endian" || line[2] != "1.0")
        throwInvalid(name, "second line is '" + clip(line.empty() ? "" : line[0]) + " " + clip(found) + "'",
                     "'format binary_little_endian 1.0'");
}

uint64_t elementCount(const std::vector<std::string_view>& line, const std::string& name)
{
    if (line.size() != 3 || line[1] != "vertex")
        throwUnsupported(name, "first element is '" + clip(line.size() > 1 ? line[1] : "") + "'", "'vertex'");
    uint64_t count = 0;
    const auto [end, error] = std::from_chars(line[2].data(), line[2].data() + line[2].size(), count);
    if (error != std::errc() || end != line[2].data() + line[2].size())
        throwInvalid(name, "vertex count is '" + clip(line[2]) + "'", "a number");
    return count;
}

// Checks that the file is long enough for its rows. `alone`: no other element follows the vertices, so it must not be
// longer.
void checkBody(const PlyHeader& header, bool alone, uint64_t file_bytes, const std::string& name)
{
    if (header.row_bytes == 0)
        throwInvalid(name, "vertices have no properties", "those of anchors");
    const uint64_t body = file_bytes - header.header_bytes;
    // note: divided instead of multiplied, because the count comes from the file and a product could wrap round
    if (header.row_count > body / header.row_bytes)
        throwInvalid(name,
                     formatString("header promises %s of %s, the file has %s left for them",
                                  formatCount(header.row_count, "row").c_str(),
                                  formatCount(header.row_bytes, "byte").c_str(), formatCount(body, "byte").c_str()),
                     "all rows", "the file is cut short, copy it again");
    const uint64_t extra = body - header.row_count * header.row_bytes;
    if (extra != 0 && alone)
        throwInvalid(name, formatCount(extra, "byte") + " behind the last of " + formatCount(header.row_count, "row"),
                     "none");
}

} // namespace

const PlyColumn* PlyHeader::find(std::string_view name) const
{
    const auto found = std::find_if(columns.begin(), columns.end(), [&](const PlyColumn& c) { return c.name == name; });
    return found == columns.end() ? nullptr : &*found;
}

PlyHeader parsePlyHeader(std::span<const std::byte> bytes, uint64_t file_bytes, const std::string& name)
{
    const std::string_view start(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kMaxPlyHeader));
    if (start.starts_with("PK\3\4"))
        throw Error(ErrorCode::Unsupported, name, "is a zip archive", "the PLY file itself", "unpack it with unzip");
    if (!start.starts_with("ply\n") && !start.starts_with("ply\r"))
        throwInvalid(name, "does not start with 'ply'", "a PLY file");
    size_t cursor = 0;
    const auto nextLine = [&] {
        const size_t end = start.find('\n', cursor);
        if (end == std::string_view::npos)
            throwNoEnd(name);
        std::string_view line = start.substr(cursor, end - cursor);
        cursor = end + 1;
        if (!line.empty() && line.back() == '\r')
            line.remove_suffix(1);
        return line;
    };
    (void)nextLine();
    PlyHeader header;
    std::vector<std::string_view> format = words(nextLine());
    for (; !format.empty() && (format[0] == "comment" || format[0] == "obj_info"); format = words(nextLine()))
        if (format[0] == "obj_info")
            header.obj_info.push_back(rest(format));
    checkFormat(format, name);

    std::unordered_set<std::string> seen;
    // `behind`: this line belongs to an element after the vertices, which is not read
    bool in_element = false, behind = false;
    for (;;) {
        const std::string_view text = nextLine();
        const std::vector<std::string_view> line = words(text);
        const std::string_view keyword = line.empty() ? "" : line[0];
        if (keyword == "end_header" && line.size() == 1)
            break;
        if (keyword == "comment")
            continue;
        if (keyword == "obj_info") {
            header.obj_info.push_back(rest(line));
        } else if (keyword == "element") {
            behind = in_element;
            if (!behind)
                header.row_count = elementCount(line, name);
            in_element = true;
        } else if (keyword == "property" && behind) {
            continue;
        } else if (keyword == "property" && in_element) {
            if (line.size() > 1 && line[1] == "list")
                throwUnsupported(name, "property '" + clip(line.back()) + "' is a list", "scalars");
            const auto type = line.size() == 3 ? kScalarBytes.find(line[1]) : kScalarBytes.end();
            if (type == kScalarBytes.end())
                throwInvalid(name, "header line '" + clip(text) + "' is no property", "'property float <name>'");
            if (!seen.insert(std::string(line[2])).second)
                throwInvalid(name, "property '" + clip(line[2]) + "' occurs twice", "unique names");
            if (header.columns.size() >= kMaxColumns)
                throwInvalid(name, formatString("more than %zu properties", kMaxColumns), "fewer");
            header.columns.push_back(
                {std::string(line[2]), header.row_bytes, line[1] == "float" || line[1] == "float32"});
            header.row_bytes += type->second;
        } else {
            // characters that no header line has: the header has no end and this is binary data
            if (std::any_of(text.begin(), text.end(), [](char c) { return (c < ' ' && c != '\t') || c > '~'; }))
                throwNoEnd(name);
            throwInvalid(name, "header line '" + clip(text) + "' is unknown", "a PLY header");
        }
    }
    if (!in_element)
        throwInvalid(name, "header has no element", "'vertex'");
    header.header_bytes = cursor;
    checkBody(header, !behind, file_bytes, name);
    return header;
}

PlyFile::PlyFile(const std::string& path) : m_file(path)
{
    std::vector<std::byte> first(std::min<uint64_t>(m_file.bytes(), kMaxPlyHeader));
    m_file.read(0, first);
    m_header = parsePlyHeader(first, m_file.bytes(), path);
}

void PlyFile::readRows(uint64_t first, std::span<std::byte> out) const
{
    m_file.read(m_header.header_bytes + first * m_header.row_bytes, out);
}

void PlyFile::prefetchRows(uint64_t first, uint64_t count) const noexcept
{
    m_file.prefetch(m_header.header_bytes + first * m_header.row_bytes, count * m_header.row_bytes);
}

} // namespace gsc
