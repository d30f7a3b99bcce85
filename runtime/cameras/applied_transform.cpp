// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/applied_transform.h"

#include "runtime/cameras/camera_fields.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr const char* kTransformKey = "applied_transform";
constexpr const char* kScaleKey = "applied_scale";

// Reads a matrix of three rows of four numbers, or of four rows of which the last is 0 0 0 1.
glm::dmat4 readTransform(const JsonObject& root)
{
    double rows[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    const bool whole = root.at(kTransformKey).is_array() && root.at(kTransformKey).size() == 4;
    root.matrix(kTransformKey, whole ? 4 : 3, 4, rows);
    if (rows[12] != 0 || rows[13] != 0 || rows[14] != 0 || rows[15] != 1)
        root.fail(kTransformKey, formatString("ending in %g %g %g %g", rows[12], rows[13], rows[14], rows[15]),
                  "a last row of 0 0 0 1");
    return transpose(glm::make_mat4(rows));
}

bool isIdentity(const glm::dmat4& m)
{
    const double* const v = glm::value_ptr(m);
    for (int i = 0; i < 16; ++i)
        if (std::abs(v[i] - (i % 5 == 0)) > 1e-9)
            return false;
    return true;
}

} // namespace

AppliedTransform::AppliedTransform(const JsonObject& root, const CameraReading& how)
{
    const glm::dmat4 applied = root.stated(kTransformKey) ? readTransform(root) : glm::dmat4(1);
    m_scale = root.stated(kScaleKey) ? root.positive(kScaleKey) : 1;
    m_undo = how.transform == CamerasTransform::Undo;
    if (!m_undo) {
        tellKept(root, !isIdentity(applied) || m_scale != 1, how);
        return;
    }
    if (!root.stated(kTransformKey) && !root.stated(kScaleKey))
        how.warn(root.where() +
                 ": has neither \"applied_transform\" nor \"applied_scale\" to undo; its poses are taken "
                 "as they stand");
    const glm::dmat3 a(applied);
    const double det = determinant(a), grows = std::cbrt(det);
    if (!(det > 1e-30 && det < 1e30) || !(orthogonalityError(a, grows * grows) < kRotationTolerance * grows * grows))
        throw Error(ErrorCode::Unsupported, root.where(),
                    formatString("key \"%s\" is no rotation with a uniform scale (determinant %g)", kTransformKey, det),
                    "one to undo", "keep the poses as they stand, or export the cameras without it")
            .with({Setting::CameraTransform});
    if (!(m_scale > 1e-12 && m_scale < 1e12))
        root.fail(kScaleKey, formatString("%g", m_scale), "a number between 1e-12 and 1e12");
    m_inverse = inverse(a);
    m_turn = m_inverse * grows;
    m_shift = glm::dvec3(applied[3]);
}

void AppliedTransform::tellKept(const JsonObject& root, bool moves, const CameraReading& how) const
{
    if (!moves || how.transform == CamerasTransform::Keep)
        return;
    const bool both = root.stated(kTransformKey) != nullptr && root.stated(kScaleKey) != nullptr;
    how.warn(formatString("%s: %s%s%s: the poses were moved away from the coordinates that they came from (COLMAP's), "
                          "and are taken as they stand; for a model in the original coordinates pass "
                          "--cameras-transform undo, else keep",
                          root.where().c_str(), root.stated(kTransformKey) ? "\"applied_transform\"" : "",
                          both ? ", " : "", root.stated(kScaleKey) ? "\"applied_scale\"" : ""));
}

glm::dmat4 AppliedTransform::undone(const glm::dmat4& camera_to_world) const
{
    if (!m_undo)
        return camera_to_world;
    const glm::dvec3 place = m_inverse * (glm::dvec3(camera_to_world[3]) / m_scale - m_shift);
    glm::dmat4 moved(m_turn * glm::dmat3(camera_to_world));
    moved[3] = glm::dvec4(place, 1);
    return moved;
}

} // namespace gsc
