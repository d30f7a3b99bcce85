// SPDX-License-Identifier: Apache-2.0
// Visible part of each view's picture, kept up to date with the runtime's masks and the eyes' angles of view.
#pragma once

#include "runtime/cli/reporter.h"
#include "player/xr/lens_mask.h"

namespace gsc {

class ViewLenses {
public:
    ViewLenses(Headset& headset, Reporter& log);

    // Computes the visible parts for the eyes located last. Warns of an invalid mask, once for each kind of fault.
    void follow(const std::vector<SpaceEye>& eyes);
    [[nodiscard]] const LensShape& of(size_t view) const { return m_views[view].shape; }
    // Sets HeadsetView::hidden of each view whose eye is known.
    void tell(HeadsetFacts& facts) const;

private:
    struct View {
        bool known = false;
        SpaceEye eye; // eye that `shape` was computed for
        LensShape shape;
        std::string fault; // fault of the mask that was warned of last
    };

    Headset& m_headset;
    Reporter& m_log;
    std::vector<View> m_views;
};

} // namespace gsc
