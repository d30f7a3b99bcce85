// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_masks.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kMost = 1 << 16; // largest number of corners, and of indices; masks of real lenses have some hundred

} // namespace

XrMasks::XrMasks(const XrRuntime& runtime, XrSession session)
    : m_runtime(runtime), m_session(session), m_meshes(runtime.facts.views.size())
{
    if (!runtime.facts.tells_mask)
        return;
    try {
        m_get = xrFunction<PFN_xrGetVisibilityMaskKHR>(runtime.instance, "xrGetVisibilityMaskKHR");
    } catch (const Error& e) { // the runtime lists the extension but lacks its function
        for (HiddenMesh& mesh : m_meshes)
            mesh.fault = formatString("cannot be had (%s), expected one", e.what());
        return;
    }
    for (uint32_t view = 0; view < m_meshes.size(); ++view)
        m_meshes[view] = ask(view);
}

void XrMasks::follow(const XrEventDataVisibilityMaskChangedKHR& event)
{
    if (m_get == nullptr || event.viewConfigurationType != m_runtime.configuration ||
        event.viewIndex >= m_meshes.size())
        return;
    m_meshes[event.viewIndex] = ask(event.viewIndex);
    m_changed = true;
}

// Asks the runtime for the mesh of a view. If the runtime fails here, nothing is hidden: pictures are drawn whole, and
// the session continues.
HiddenMesh XrMasks::ask(uint32_t view) const
{
    const auto failed = [](XrResult result) {
        HiddenMesh none;
        none.fault = formatString("cannot be had (xrGetVisibilityMaskKHR: code %d), expected one", int(result));
        return none;
    };
    auto mask = xrInfo<XrVisibilityMaskKHR>(XR_TYPE_VISIBILITY_MASK_KHR);
    const auto get = [&] {
        return m_get(m_session, m_runtime.configuration, view, XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR, &mask);
    };
    if (const XrResult result = get(); XR_FAILED(result))
        return failed(result);
    HiddenMesh mesh;
    const uint32_t corners = mask.vertexCountOutput, indices = mask.indexCountOutput;
    if (corners > kMost || indices > kMost) {
        mesh.fault = formatString("has %u corners and %u indices, expected at most %u each", corners, indices, kMost);
        return mesh;
    }
    if (corners == 0 || indices == 0)
        return mesh;
    std::vector<XrVector2f> points(corners);
    mesh.indices.resize(indices);
    mask.vertexCapacityInput = corners;
    mask.vertices = points.data();
    mask.indexCapacityInput = indices;
    mask.indices = mesh.indices.data();
    if (const XrResult result = get(); XR_FAILED(result))
        return failed(result);
    // the mesh may have changed since its length was asked for; an event will tell
    points.resize(std::min(mask.vertexCountOutput, corners));
    mesh.indices.resize(std::min(mask.indexCountOutput, indices));
    for (const XrVector2f& point : points)
        mesh.vertices.push_back({point.x, point.y});
    return mesh;
}

} // namespace gsc
