// SPDX-License-Identifier: Apache-2.0
// 51xx: view sensitivities.
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
        // a value of a group that is none is one issue, not two
        {GroupValue,
         edit<GroupRecord>(kSectionGroups, 1, [](GroupRecord& g) { g.view_sensitivity = INFINITY; }),
         {SensitivityChunk},
         baked()},
    };
}

} // namespace gsc::test
