// SPDX-License-Identifier: Apache-2.0
// Meshes of the parts of views that lenses hide (XR_KHR_visibility_mask), kept as the runtime states them.
#pragma once

#include "player/present/headset/xr_runtime.h"

#include <utility>

namespace gsc {

class XrMasks {
public:
    XrMasks(const XrRuntime& runtime, XrSession session); // without the extension nothing is hidden

    void follow(const XrEventDataVisibilityMaskChangedKHR& event);
    bool changed() { return std::exchange(m_changed, false); }
    [[nodiscard]] const HiddenMesh& of(size_t view) const { return m_meshes.at(view); }

private:
    [[nodiscard]] HiddenMesh ask(uint32_t view) const;

    const XrRuntime& m_runtime;
    XrSession m_session;
    PFN_xrGetVisibilityMaskKHR m_get = nullptr;
    std::vector<HiddenMesh> m_meshes; // mesh of each view
    bool m_changed = false;
};

} // namespace gsc
