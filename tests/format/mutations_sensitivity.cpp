// SPDX-License-Identifier: Apache-2.0
// 51xx: view sensitivities; 52xx: tiles.
#include "tests/format/mutation.h"

#include <cmath>

namespace gsc::test {

namespace {

TinyGscOptions baked()
{
    TinyGscOptions o;
    o.sensitivity = true;
    return o;
}

std::function<void(Bytes&)> anchor(void (*change)(AnchorSensitivity&))
{
    return edit<AnchorSensitivity>(kSectionSensitivity, 131, change);
}

TinyGscOptions cut()
{
    TinyGscOptions o;
    o.tile = true;
    return o;
}

// Rows follow the record of 16 bytes.
std::function<void(Bytes&)> row(size_t index, uint32_t value)
{
    return [=](Bytes& file) { records<uint32_t>(file, kSectionTile)[sizeof(TileRecord) / 4 + index] = value; };
}

} // namespace

std::vector<Mutation> sensitivityMutations()
{
    using namespace issue;
    return {
        {SensitivityValue, anchor([](AnchorSensitivity& s) { s.direction = 0x7c00; }), {}, baked()}, // infinity
        {SensitivityValue, anchor([](AnchorSensitivity& s) { s.direction = 0x7e00; }), {}, baked()}, // NaN
        {SensitivityValue, anchor([](AnchorSensitivity& s) { s.distance = 0x7c01; }), {}, baked()},
        {SensitivityValue, anchor([](AnchorSensitivity& s) { s.distance = 0xbc00; }), {}, baked()}, // -1
        {SensitivityGroup, anchor([](AnchorSensitivity& s) { s.direction = 0x7bff; }), {}, baked()},
        {SensitivityGroup,
         edit<GroupRecord>(kSectionGroups, 1, [](GroupRecord& g) { g.view_sensitivity = 0; }),
         {},
         baked()},
        {SensitivityChunk,
         edit<ChunkRecord>(kSectionChunks, 0,
                           [](ChunkRecord& c) { c.view_sensitivity = std::nextafter(c.view_sensitivity, 0.0f); }),
         {},
         baked()},
        {SectionCount, editEntry(kSectionSensitivity, [](SectionEntry& e) { e.count -= 1; }), {}, baked()},
        {SectionBytes,
         editSections([](std::vector<TinySection>& s) { find(s, kSectionSensitivity).content.resize(8); }),
         {},
         baked()},
        {SectionVersion, editEntry(kSectionSensitivity, [](SectionEntry& e) { e.version = 2; }), {}, baked()},
        {TileWhole, edit<TileRecord>(kSectionTile, 0, [](TileRecord& t) { t.whole_anchors /= 2; }), {TileRow}, cut()},
        {TileWhole, edit<TileRecord>(kSectionTile, 0, [](TileRecord& t) { t.whole_anchors = UINT64_MAX; }), {}, cut()},
        {TileRow, row(7, 13), {}, cut()}, // the one before is 13
        {TileRow, row(0, UINT32_MAX), {}, cut()},
        {SectionCount, editEntry(kSectionTile, [](SectionEntry& e) { e.count -= 1; }), {}, cut()},
        {SectionBytes,
         editSections([](std::vector<TinySection>& s) { find(s, kSectionTile).content.resize(8); }),
         {},
         cut()},
        // a value of a group that is none is one issue, not two
        {GroupValue,
         edit<GroupRecord>(kSectionGroups, 1, [](GroupRecord& g) { g.view_sensitivity = INFINITY; }),
         {SensitivityChunk},
         baked()},
    };
}

} // namespace gsc::test
