// SPDX-License-Identifier: Apache-2.0
// Checks SENS: values that are finite and not negative, and bounds in groups and chunks that are not below them.
#include "format/validate/gsc_validate.h"
#include <gsc/half.h>

#include <algorithm>
#include <cstddef>

namespace gsc::validate {

namespace {

// Reports a half that is infinite, NaN or negative: as integers, the bits of these lie above those of the largest valid
// half.
void checkValue(Context& context, uint64_t anchor, const char* name, size_t offset, uint16_t bits)
{
    if (bits > kMaxHalfBits)
        GSC_REPORT(context.log, SensitivityValue,
                   context.offsetOf(kSectionSensitivity) + anchor * sizeof(AnchorSensitivity) + offset,
                   place("sensitivity", anchor, name), name, anchor, unsigned(bits));
}

void checkGroup(Context& context, uint64_t i)
{
    const GroupRecord& group = context.view.groups[i];
    const auto anchors = context.view.sensitivity.subspan(group.anchor_first, group.anchor_count);
    const auto most =
        std::max_element(anchors.begin(), anchors.end(), [](const AnchorSensitivity& a, const AnchorSensitivity& b) {
            return a.direction < b.direction;
        });
    // an invalid value was reported already, so only a valid one is compared with the bound
    if (most->direction > kMaxHalfBits || halfToFloat(most->direction) <= group.view_sensitivity)
        return;
    GSC_REPORT(context.log, SensitivityGroup,
               context.offsetOf(kSectionGroups) + i * sizeof(GroupRecord) + offsetof(GroupRecord, view_sensitivity),
               place("groups", i, "view_sensitivity"), i, double(group.view_sensitivity),
               unsigned(group.anchor_first + uint32_t(most - anchors.begin())), double(halfToFloat(most->direction)));
}

} // namespace

void checkSensitivity(Context& context, bool ranges_sound)
{
    const GscView& view = context.view;
    if (view.sensitivity.empty())
        return;
    for (uint64_t i = 0; i < view.sensitivity.size(); ++i) {
        checkValue(context, i, "direction", offsetof(AnchorSensitivity, direction), view.sensitivity[i].direction);
        checkValue(context, i, "distance", offsetof(AnchorSensitivity, distance), view.sensitivity[i].distance);
    }
    if (!ranges_sound)
        return;
    for (uint32_t c = 0; c < view.chunks.size(); ++c) {
        const ChunkRecord& chunk = view.chunks[c];
        for (uint64_t g = chunk.group_first; g < uint64_t(chunk.group_first) + chunk.group_count; ++g) {
            checkGroup(context, g);
            const float sensitivity = view.groups[g].view_sensitivity;
            if (sensitivity > chunk.view_sensitivity)
                GSC_REPORT(context.log, SensitivityChunk,
                           context.offsetOf(kSectionChunks) + c * sizeof(ChunkRecord) +
                               offsetof(ChunkRecord, view_sensitivity),
                           place("chunks", c, "view_sensitivity"), c, double(chunk.view_sensitivity), g,
                           double(sensitivity));
        }
    }
}

} // namespace gsc::validate
