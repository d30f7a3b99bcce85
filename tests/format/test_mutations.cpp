// SPDX-License-Identifier: Apache-2.0
// Every issue in the table has a file that raises it, and that file raises nothing unexpected.
#include "tests/format/mutation.h"
#include "tests/support/source_folder.h"

#include <doctest/doctest.h>

#include <cctype>
#include <fstream>
#include <sstream>

using namespace gsc;
using namespace gsc::test;

namespace {

// Found by `gsc validate`, which has a JSON parser and NanoVDB; their cases lie in tests/cli and tests/write. And those of
// archives, in test_archive.cpp.
const std::set<uint16_t> kReportedElsewhere = {issue::ManifestJson,
                                               issue::GridType,
                                               issue::GridTree,
                                               issue::GridChecksum,
                                               issue::GridLeaf,
                                               issue::GridCells,
                                               issue::ArchiveList,
                                               issue::ArchivePartRange,
                                               issue::ArchivePartRaw,
                                               issue::ArchiveFront,
                                               issue::ArchiveExpansion,
                                               issue::ArchiveRawBytes,
                                               issue::ArchiveReserved,
                                               issue::ArchiveChecksum,
                                               issue::ArchiveUndecodable,
                                               issue::ArchiveContent,
                                               issue::ArchiveCodecUnknown,
                                               issue::ArchiveCodecMissing};

std::vector<Mutation> allMutations()
{
    std::vector<Mutation> all;
    for (auto* part : {tableMutations, modelMutations, chunkMutations, weightMutations, sensitivityMutations,
                       cameraMutations, payloadMutations})
        for (Mutation& m : part())
            all.push_back(std::move(m));
    return all;
}

std::string text(const std::set<uint16_t>& ids)
{
    std::ostringstream out;
    for (const uint16_t id : ids)
        out << issueInfo(id).name << ' ';
    return out.str();
}

} // namespace

TEST_CASE("every mutation raises its issue and no other")
{
    size_t number = 0;
    for (const Mutation& mutation : allMutations()) {
        ++number;
        const std::string name = issueInfo(mutation.id).name;
        CAPTURE(number);
        CAPTURE(name);
        const Verdict verdict = check(mutate(mutation));
        CHECK(text(verdict.ids) == text(mutation.also + mutation.id));
        bool expected_good = true;
        for (const uint16_t id : verdict.ids)
            expected_good &= issueInfo(id).severity == Severity::Warning;
        CHECK(verdict.good == expected_good);
        for (const Issue& found : verdict.issues) {
            CHECK(!found.detail.empty());
            CHECK(found.detail.size() < 400);
            if (verdict.ids != mutation.also + mutation.id)
                MESSAGE(found.info->name << " " << found.pointer << " " << found.detail);
        }
    }
}

TEST_CASE("the offset of an issue is that of the field that was changed")
{
    using namespace issue;
    // those that speak of a section, of a range of records, or of the second of two that do not go together
    const std::set<uint16_t> elsewhere = {
        Truncated,        SectionBytes,    GridSectionBytes, AnchorsBytes,         PayloadPadding,  ManifestText,
        HeaderChecksum,   SectionChecksum, SectionCount,     PayloadChecksum,      LevelCover,      ChunkCover,
        ChunkOrder,       LeafCover,       LeafOrder,        LeafNanoVdbDuplicate, IndexDuplicate,  AnchorOrder,
        MlpWeightOverlap, PackedOverlap,   CameraNameText,   SensitivityGroup,     AnchorsNotFirst, CompactValue};
    const std::set<uint16_t> of_record = {SectionRange, LevelRange, GridRange,  ChunkAnchors,
                                          GroupAnchors, GroupValue, CameraFocal};
    const std::set<uint16_t> of_bounds = {ParamBounds, LevelBounds, ChunkBounds, GroupBounds};
    size_t checked = 0;
    for (Mutation& mutation : allMutations()) {
        const Bytes before = tinyGsc(mutation.options);
        Bytes after = before;
        mutation.apply(after);
        if (after.size() != before.size() || elsewhere.contains(mutation.id))
            continue;
        const int64_t at = std::mismatch(before.begin(), before.end(), after.begin()).first - before.begin();
        const std::vector<Issue> issues = check(mutate(mutation)).issues;
        const auto found = std::find_if(issues.begin(), issues.end(),
                                        [&](const Issue& issue) { return issue.info->id == mutation.id; });
        REQUIRE(found != issues.end());
        const std::string name = found->info->name;
        CAPTURE(name);
        CAPTURE(found->pointer);
        const int64_t behind = at - int64_t(found->offset);
        CAPTURE(behind);
        // of bounds the maximum may be the one that was changed, three or four floats behind the minimum
        const bool is_maximum = of_bounds.contains(mutation.id) && behind >= 12 && behind < 20;
        const bool close = (behind >= 0 && behind < 8) || is_maximum;
        CHECK((close || (of_record.contains(mutation.id) && behind >= -8 && behind < 64)));
        ++checked;
    }
    CHECK(checked > 200);
}

TEST_CASE("values at their limits are valid")
{
    TinyGscOptions octree;
    octree.levels = 2;
    const std::pair<std::function<void(Bytes&)>, TinyGscOptions> changes[] = {
        {edit<CameraRecord>(kSectionCameras, 1, [](CameraRecord& c) { c.width = c.height = 1; }), {}},
        {edit<CameraRecord>(kSectionCameras, 1, [](CameraRecord& c) { c.width = c.height = 32768; }), {}},
        {edit<CameraRecord>(kSectionCameras, 1, [](CameraRecord& c) { c.rotation[0] *= 1.0004; }), {}},
        {edit<CameraRecord>(kSectionCameras, 1, [](CameraRecord& c) { c.appearance = -1; }), {}},
        {edit<ModelParams>(kSectionParams, 0, [](ModelParams& p) { p.level_clamp = 0; }), octree},
        {edit<ModelParams>(kSectionParams, 0, [](ModelParams& p) { p.flags &= ~uint32_t(kModelLodHalfCell); }), octree},
        {edit<ModelParams>(kSectionParams, 0, [](ModelParams& p) { p.standard_dist = 0; }), {}},
        {edit<ModelParams>(kSectionParams, 0, [](ModelParams& p) { p.near_z = 0; }), {}},
    };
    size_t number = 0;
    for (const auto& [change, options] : changes) {
        CAPTURE(++number);
        Bytes file = tinyGsc(options);
        change(file);
        reseal(file);
        CHECK(text(check(file).ids).empty());
    }
}

TEST_CASE("a detail says what was found and what would be right")
{
    const auto detailOf = [](uint16_t id, const std::string& pointer) {
        for (const Mutation& mutation : allMutations())
            for (const Issue& found : mutation.id == id ? check(mutate(mutation)).issues : std::vector<Issue>())
                if (found.pointer == pointer)
                    return found.detail;
        return std::string();
    };
    CHECK(detailOf(issue::PositionLeaf, "/anchors/106/position") == "local[0] is 80, the leaf spans 64..79");
}

TEST_CASE("every issue of the table has a mutation")
{
    std::set<uint16_t> covered = kReportedElsewhere;
    for (const Mutation& mutation : allMutations())
        covered.insert(mutation.id);
    for (const IssueInfo& info : allIssues()) {
        const std::string name = info.name;
        CAPTURE(name);
        CHECK(covered.count(info.id) == 1);
    }
    CHECK(covered.size() == allIssues().size());
}

TEST_CASE("the index check finds all but what only the payloads show")
{
    for (const Mutation& mutation : allMutations()) {
        const std::string name = issueInfo(mutation.id).name;
        CAPTURE(name);
        const bool in_payload = mutation.id / 1000 == 8 || mutation.id == issue::PackedContent;
        const Verdict verdict = check(mutate(mutation), GscCheck::Index);
        CHECK(verdict.ids.count(mutation.id) == (in_payload ? 0 : 1));
    }
}

TEST_CASE("a damaged array does not flood the sink")
{
    Bytes file = tinyGsc();
    for (uint32_t i = 0; i < 300; ++i)
        records<uint32_t>(file, kSectionIndex)[i] = 1000;
    reseal(file);
    const Verdict verdict = check(file);
    CHECK(!verdict.good);
    size_t count = 0;
    for (const Issue& found : verdict.issues)
        count += found.info->id == issue::IndexRange;
    CHECK(count == 16);
}

TEST_CASE("the issue table is complete in itself")
{
    std::set<std::string> names;
    for (const IssueInfo& info : allIssues()) {
        CAPTURE(info.id);
        CHECK(info.id >= 1001);
        CHECK(info.id <= 9999);
        CHECK(names.insert(info.name).second);
        CHECK(std::string(info.summary).size() > 10);
        CHECK(std::string(info.detail).size() > 1);
        CHECK(&issueInfo(info.id) == &info);
    }
}

TEST_CASE("schemas/gsc.md lists every issue and no other")
{
    std::ifstream page(sourceFolder() + "/schemas/gsc.md");
    REQUIRE(page);
    std::string expected, found;
    for (const IssueInfo& info : allIssues()) {
        constexpr const char* kNames[] = {"Warning", "Error", "Fatal"};
        expected += "| " + std::to_string(info.id) + " | " + kNames[int(info.severity)] + " | " + info.name + " | " +
                    info.summary + " |\n";
    }
    const auto isIssue = [](const std::string& line) {
        return line.size() > 9 && line.rfind("| ", 0) == 0 && line.find(" | ") == 6 &&
               line.find_first_not_of("0123456789", 2) == 6 && std::isupper(static_cast<unsigned char>(line[9]));
    };
    for (std::string line; std::getline(page, line);)
        if (isIssue(line))
            found += line + "\n";
    CHECK(found == expected);
}
