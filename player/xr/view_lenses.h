// SPDX-License-Identifier: Apache-2.0
// Part of its picture that each view of a headset shows, kept up with the masks that the runtime tells and with the
// angles of the eyes.
#pragma once

#include "runtime/cli/reporter.h"
#include "player/xr/lens_mask.h"

namespace gsc {

class ViewLenses {
public:
    ViewLenses(Headset& headset, Reporter& log);

    // With the eyes of the views, as they were located last. Warns of a mask that makes no sense, once for each that is wrong in another way.
    void follow(const std::vector<SpaceEye>& eyes);
    [[nodiscard]] const LensShape& of(size_t view) const { return m_views[view].shape; }
    // HeadsetView::hidden, of each view that eyes were known of.
    void tell(HeadsetFacts& facts) const;

private:
    struct View {
        bool known = false;
        SpaceEye eye; // that `shape` is of
        LensShape shape;
        std::string fault; // that was told
    };

    Headset& m_headset;
    Reporter& m_log;
    std::vector<View> m_views;
};

} // namespace gsc
