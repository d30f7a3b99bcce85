// SPDX-License-Identifier: Apache-2.0
// Checks TILE: the rows of the whole file that a tile has.
#include "format/validate/gsc_validate.h"

#include <cstddef>

namespace gsc::validate {

void checkTile(Context& context)
{
    const GscView& view = context.view;
    if (view.tile == nullptr)
        return;
    const uint64_t offset = context.offsetOf(kSectionTile);
    const uint64_t whole = view.tile->whole_anchors;
    // a tile has fewer anchors than the whole file
    if (whole <= view.tile_rows.size() || whole > kMaxAnchors)
        GSC_REPORT(context.log, TileWhole, offset + offsetof(TileRecord, whole_anchors), "/tile/whole_anchors", whole,
                   uint64_t(view.tile_rows.size() + 1), kMaxAnchors);
    uint64_t least = 0; // smallest row number that may come next
    for (uint64_t i = 0; i < view.tile_rows.size(); ++i) {
        const uint64_t row = view.tile_rows[i];
        if (row < least || row >= whole)
            GSC_REPORT(context.log, TileRow, offset + sizeof(TileRecord) + i * sizeof(uint32_t),
                       place("tile", i, "row"), i, row, least, whole);
        least = row + 1;
    }
}

} // namespace gsc::validate
