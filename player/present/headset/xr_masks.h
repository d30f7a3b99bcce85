// SPDX-License-Identifier: Apache-2.0
// Meshes of the parts of views that lenses hide (XR_KHR_visibility_mask), as the runtime states them.
#pragma once

#include "player/present/headset/xr_runtime.h"

#include <utility>

namespace gsc {

class XrMasks {
public:
    // asks the runtime for the masks; without the extension no part is hidden
    XrMasks(const XrRuntime& runtime, XrSession session);

    void follow(const XrEventDataVisibilityMaskChangedKHR& event);
    bool changed() { return std::exchange(m_changed, false); }
    [[nodiscard]] const HiddenMesh& of(size_t view) const { return m_meshes.at(view); }

private:
    [[nodiscard]] HiddenMesh ask(uint32_t view) const;

    const XrRuntime& m_runtime;
    XrSession m_session;
    PFN_xrGetVisibilityMaskKHR m_get = nullptr;
    std::vector<HiddenMesh> m_meshes; // mesh of each view, as stated last
    bool m_changed = false;
};

} // namespace gsc
