// SPDX-License-Identifier: Apache-2.0
#include "convert/input/ply_reader.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr uint32_t kOffsets = 2, kFeatures = 3;

Outcome parse(const std::string& text)
{
    // exact-size heap copy, so that ASan sees a read of even one byte too many
    const std::unique_ptr<std::byte[]> copy(new std::byte[text.size()]);
    std::memcpy(copy.get(), text.data(), text.size());
    return outcomeOf([&] {
        const PlyHeader header = parsePlyHeader({copy.get(), text.size()}, text.size(), "t.ply");
        const AnchorColumns columns = findAnchorColumns(header, "t.ply");
        AnchorBatch batch;
        sizeBatch(batch, columns, kAnchorAll, size_t(header.row_count));
        decodeAnchorRows({copy.get() + header.header_bytes, text.size() - header.header_bytes}, header.row_bytes,
                         columns, kAnchorAll, 0, batch, 0, "t.ply");
    });
}

AnchorBatch decode(const PlyText& ply, uint32_t fields = kAnchorAll)
{
    const std::string text = ply.text();
    const auto bytes = std::as_bytes(std::span(text));
    const PlyHeader header = parsePlyHeader(bytes, bytes.size(), "t.ply");
    const AnchorColumns columns = findAnchorColumns(header, "t.ply");
    AnchorBatch batch;
    sizeBatch(batch, columns, fields, size_t(header.row_count));
    decodeAnchorRows(bytes.subspan(header.header_bytes), header.row_bytes, columns, fields, 0, batch, 0, "t.ply");
    return batch;
}

std::string replaced(std::string text, const std::string& from, const std::string& to)
{
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

} // namespace

TEST_CASE("PLY, trap 6: offsets are axis-major in the file and k-major after it")
{
    PlyText ply = makePly(Columns::Scaffold, 3, kOffsets, kFeatures);
    const AnchorBatch batch = decode(ply);
    REQUIRE(batch.offset.size() == 3 * 3 * kOffsets);
    for (size_t row = 0; row < 3; ++row)
        for (size_t k = 0; k < kOffsets; ++k)
            for (size_t axis = 0; axis < 3; ++axis)
                CHECK(batch.offset[(row * kOffsets + k) * 3 + axis] ==
                      ply.at(row, "f_offset_" + std::to_string(axis * kOffsets + k)));
}

TEST_CASE("PLY, trap 8: Scaffold-GS and Octree-GS rows have the same size and are told apart by name")
{
    PlyText scaffold = makePly(Columns::Scaffold, 2, 10, 32), octree = makePly(Columns::Octree, 2, 10, 32);
    CHECK(scaffold.columns.size() == octree.columns.size());
    CHECK(scaffold.columns.size() * sizeof(float) == 316);
    const AnchorBatch a = decode(scaffold), b = decode(octree);
    CHECK(a.normal[1] == scaffold.at(0, "ny"));
    CHECK(a.level == std::vector<int32_t>{0, 0});
    CHECK(a.extra_level == std::vector<float>{0, 0});
    CHECK(b.normal == std::vector<float>(6, 0.0f));
    CHECK(b.level == std::vector<int32_t>{0, 1});
    CHECK(b.extra_level[1] == octree.at(1, "extra_level"));
}

TEST_CASE("PLY: columns are found by name and sorted by number, in any order and with foreign columns between")
{
    PlyText ply = makePly(Columns::Octree, 4, 4, 12); // f_offset_10 sorts before f_offset_2 as text
    const AnchorBatch expected = decode(ply);
    PlyText shuffled = ply;
    std::reverse(shuffled.columns.begin(), shuffled.columns.end());
    for (std::vector<float>& row : shuffled.rows)
        std::reverse(row.begin(), row.end());
    shuffled.columns.insert(shuffled.columns.begin() + 7, "confidence");
    for (std::vector<float>& row : shuffled.rows)
        row.insert(row.begin() + 7, 99.0f);
    const AnchorBatch actual = decode(shuffled);
    CHECK(actual.position == expected.position);
    CHECK(actual.level == expected.level);
    CHECK(actual.extra_level == expected.extra_level);
    CHECK(actual.offset == expected.offset);
    CHECK(actual.feature == expected.feature);
    CHECK(actual.scale == expected.scale);
    CHECK(actual.rotation == expected.rotation);
    CHECK(actual.opacity == expected.opacity);
    for (size_t row = 0; row < 4; ++row)
        CHECK(expected.feature[12 * row + 10] == ply.at(row, "f_anchor_feat_10"));
}

TEST_CASE("PLY: only the fields that are asked for are filled")
{
    const AnchorBatch batch = decode(makePly(Columns::Octree, 3, kOffsets, kFeatures), kAnchorPlacement);
    CHECK(batch.position.size() == 9);
    CHECK(batch.level.size() == 3);
    CHECK(batch.extra_level.size() == 3);
    CHECK((batch.offset.empty() && batch.feature.empty() && batch.scale.empty() && batch.rotation.empty() &&
           batch.opacity.empty() && batch.normal.empty()));
}

TEST_CASE("PLY, traps 15, 18 and 31: -inf, NaN and large scales are passed on bit for bit")
{
    PlyText ply = makePly(Columns::Scaffold, 3, kOffsets, kFeatures);
    ply.at(0, "scale_0") = -std::numeric_limits<float>::infinity();
    ply.at(1, "scale_4") = 5.57f; // above the clamp at 0.05, which holds only while the trainer prunes
    ply.at(2, "x") = std::numeric_limits<float>::quiet_NaN();
    ply.at(0, "y") = -0.0f;
    const AnchorBatch batch = decode(ply);
    CHECK(batch.scale[0] == -std::numeric_limits<float>::infinity());
    CHECK(batch.scale[6 + 4] == 5.57f);
    CHECK(std::isnan(batch.position[6]));
    CHECK(std::signbit(batch.position[1]));
}

TEST_CASE("PLY, trap 29: extra_level keeps its fp32 bits")
{
    PlyText ply = makePly(Columns::Octree, 2, kOffsets, kFeatures);
    float sum = 0;
    for (int i = 0; i < 6; ++i)
        sum += 0.01f; // 0.05999999, not 0.06
    CHECK(sum != 0.06f);
    ply.at(1, "extra_level") = sum;
    CHECK(decode(ply).extra_level[1] == sum);
}

TEST_CASE("PLY: float32 is an alias, level is truncated, models without opacity get the trainers' constant")
{
    PlyText ply = makePly(Columns::AnyLod, 3, kOffsets, kFeatures);
    ply.type = "float32";
    ply.at(2, "level") = 1.99f;
    const AnchorBatch batch = decode(ply);
    CHECK(batch.level == std::vector<int32_t>{0, 1, 1});
    for (const float opacity : batch.opacity)
        CHECK(opacity == doctest::Approx(std::log(0.1 / 0.9)).epsilon(1e-6));
}

TEST_CASE("PLY: header facts")
{
    const PlyText ply = makePly(Columns::AnyLod, 3, kOffsets, kFeatures);
    const std::string text = replaced(ply.text(), "element", "comment written by hand\nelement");
    const PlyHeader header = parsePlyHeader(std::as_bytes(std::span(text)), text.size(), "t.ply");
    CHECK(header.row_count == 3);
    CHECK(header.row_bytes == 4 * ply.columns.size());
    CHECK(header.obj_info == std::vector<std::string>{"standard_dist 12.345679", "levels 3.000000"});
    CHECK(header.find("rot_3")->offset == header.row_bytes - 4);
    CHECK(header.find("rot_4") == nullptr);
}

TEST_CASE("PLY: every truncation and every appended byte is refused")
{
    const std::string text = makePly(Columns::Octree, 2, 1, 2).text();
    CHECK(parse(text).code == ErrorCode::Ok);
    for (size_t size = 0; size < text.size(); ++size)
        REQUIRE(parse(text.substr(0, size)).code == ErrorCode::InvalidFile);
    CHECK(parse(text + '\0').says("1 byte behind the last of 2 rows"));
}

TEST_CASE("PLY: flipped bits end in an Error or in other numbers, never elsewhere")
{
    const std::string text = makePly(Columns::Octree, 2, 1, 2).text();
    for (size_t i = 0; i < 8 * text.size(); ++i) {
        std::string flipped = text;
        flipped[i / 8] = char(flipped[i / 8] ^ (1 << (i % 8)));
        const ErrorCode code = parse(flipped).code;
        REQUIRE((code == ErrorCode::Ok || code == ErrorCode::InvalidFile || code == ErrorCode::Unsupported));
    }
}

TEST_CASE("PLY: refusals name what was found")
{
    const std::string text = makePly(Columns::Octree, 2, kOffsets, kFeatures).text();
    const auto refuses = [](const std::string& bytes, ErrorCode code, const char* message) {
        const Outcome outcome = parse(bytes);
        CAPTURE(outcome.message);
        CHECK(outcome.code == code);
        CHECK(outcome.says(message));
    };
    using enum ErrorCode;
    CHECK(parse(replaced(text, "element vertex", "comment ~ a tilde\telement\nelement vertex")).code == Ok);
    refuses(replaced(text, "binary_little_endian", "binary_big_endian"), Unsupported, "binary_big_endian");
    refuses(replaced(text, "binary_little_endian", "ascii"), Unsupported, "format is ascii");
    refuses(replaced(text, "1.0", "2.0"), InvalidFile, "format");
    refuses("PNG" + text, InvalidFile, "does not start with 'ply'");
    for (size_t i = 0; i < 4; ++i) {
        std::string other = text;
        other[i] = 'z';
        refuses(other, InvalidFile, "does not start with 'ply'");
    }
    refuses("ply", InvalidFile, "does not start with 'ply'");
    refuses(replaced(text, "property float x", "property list uchar int x"), Unsupported, "is a list");
    refuses(replaced(text, "property float y", "property float x"), InvalidFile, "'x' occurs twice");
    refuses(replaced(text, "property float x", "property double x"), InvalidFile, "header promises");
    refuses(replaced(text, "property float x", "property int x"), Unsupported, "'x' is not float32");
    refuses(replaced(text, "property float x", "property half x"), InvalidFile, "is no property");
    refuses(replaced(text, "float x\n", "float w\n"), InvalidFile, "'x' is missing");
    refuses(replaced(text, "f_offset_3", "f_offset_7"), InvalidFile, "'f_offset_3' is missing");
    refuses(replaced(text, "f_offset_3", "f_offset_3b"), InvalidFile, "has no number");
    refuses(replaced(text, "scale_5", "scalf_5"), InvalidFile, "5 columns scale_<n>");
    refuses(replaced(text, "element vertex", "element face"), Unsupported, "element is 'face'");
    refuses(replaced(text, "vertex 2", "vertex -2"), InvalidFile, "vertex count is '-2'");
    refuses(replaced(text, "vertex 2", "vertex 18446744073709551615"), InvalidFile, "header promises");
    refuses(replaced(text, "vertex 2", "vertex 18446744073709551616"), InvalidFile, "vertex count");
    refuses(replaced(text, "vertex 2", "vertex 4611686018427387904"), InvalidFile, "header promises");
    refuses(replaced(text, "vertex 2", "vertex 1"), InvalidFile, "bytes behind the last of 1 row");
}

TEST_CASE("PLY: headers as other programs leave them")
{
    const std::string text = makePly(Columns::AnyLod, 2, kOffsets, kFeatures).text();
    const size_t end = text.find("end_header\n") + 11;
    std::string crlf;
    for (const char c : text.substr(0, end))
        crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    const auto read = [](const std::string& bytes) {
        return parsePlyHeader(std::as_bytes(std::span(bytes)), bytes.size(), "t.ply");
    };
    const auto same = [&](const std::string& bytes) {
        const Outcome outcome = parse(bytes);
        CHECK_MESSAGE(outcome.code == ErrorCode::Ok, outcome.message);
        if (outcome.code != ErrorCode::Ok)
            return;
        CHECK(read(bytes).obj_info == read(text).obj_info);
        CHECK(read(bytes).row_bytes == read(text).row_bytes);
        CHECK(read(bytes).columns.size() == read(text).columns.size());
    };
    same(crlf + text.substr(end));
    same(replaced(text, "format", "comment made by hand\nformat"));
    same(replaced(text, "element vertex", "comment caf\xe9 \xc3\xa9\ncomment\nelement vertex"));
    same(replaced(text, "property float x\n", "property\tfloat \tx \n"));
    same(replaced(text, "end_header\n", "end_header \n"));
    same(replaced(text, "obj_info standard", "obj_info  standard"));
    // elements behind the vertices, empty or not
    same(replaced(text, "end_header", "element face 0\nproperty list uchar int vertex_indices\nend_header"));
    same(replaced(text, "end_header", "element camera 1\nproperty float x\nend_header") + "1234");
    // obj_info before the format
    const size_t info = text.find("obj_info"), element = text.find("element");
    same("ply\n" + text.substr(info, element - info) + "format binary_little_endian 1.0\n" + text.substr(element));
    // columns that nothing needs may be of any type
    const std::string extra =
        replaced(text, "property float x\n", "property double time\nproperty uchar red\nproperty float x\n");
    CHECK(read(extra + std::string(18, '\0')).row_bytes == read(text).row_bytes + 9);
}

TEST_CASE("PLY: what the SIBR viewer's crop tool saves is refused as that")
{
    const std::string text = makePly(Columns::Octree, 2, kOffsets, kFeatures).text();
    const Outcome no_end = parse(replaced(text, "end_header\n", ""));
    CHECK(no_end.code == ErrorCode::InvalidFile);
    CHECK(no_end.says("SIBR viewer"));
    PlyText no_rotation = makePly(Columns::Octree, 2, kOffsets, kFeatures);
    no_rotation.columns.resize(no_rotation.columns.size() - 4);
    for (std::vector<float>& row : no_rotation.rows)
        row.resize(no_rotation.columns.size());
    CHECK(parse(no_rotation.text()).says("SIBR viewer"));
}

TEST_CASE("PLY: levels no trainer writes are refused by vertex number")
{
    for (const float level : {-1.0f, 64.0f, 1e30f, std::numeric_limits<float>::quiet_NaN()}) {
        PlyText ply = makePly(Columns::Octree, 4, kOffsets, kFeatures);
        ply.at(3, "level") = level;
        const Outcome outcome = parse(ply.text());
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says("level of vertex 3"));
    }
}

TEST_CASE("PLY file: rows are read by position")
{
    const TemporaryFolder folder;
    const PlyText ply = makePly(Columns::Scaffold, 6, kOffsets, kFeatures);
    writeFile(folder.path() / "a.ply", ply.text());
    const PlyFile file((folder.path() / "a.ply").string());
    std::vector<std::byte> rows(2 * file.header().row_bytes);
    file.readRows(4, rows);
    CHECK(std::memcmp(rows.data(), ply.rows[4].data(), file.header().row_bytes) == 0);
    CHECK(std::memcmp(rows.data() + file.header().row_bytes, ply.rows[5].data(), file.header().row_bytes) == 0);
    CHECK(outcomeOf([&] { file.readRows(5, rows); }).code == ErrorCode::Io); // one row beyond the end
    CHECK(outcomeOf([&] { PlyFile((folder.path() / "none.ply").string()); }).code == ErrorCode::Io);
    CHECK(outcomeOf([&] { PlyFile(folder.path().string()); }).code == ErrorCode::Io);
}
