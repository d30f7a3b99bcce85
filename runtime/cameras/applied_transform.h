// SPDX-License-Identifier: Apache-2.0
// nerfstudio's keys applied_transform and applied_scale: how a file's poses were moved away from those of the model
// that they came from, position = scale * (transform * original position).
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <glm/mat4x4.hpp>

#include <optional>

namespace gsc {

// Moves the camera-to-world matrices of `root`'s frames back, if `how` asks for that; else leaves them and warns in
// `how`. A transform with a scale scales positions only, so that cameras stay rigid. Throws Error(InvalidFile) if the
// keys have other values; Error(Unsupported) if a transform to undo stretches or mirrors.
class AppliedTransform {
public:
    AppliedTransform(const JsonObject& root, const CameraReading& how);

    [[nodiscard]] glm::dmat4 undone(const glm::dmat4& camera_to_world) const;

private:
    void tellKept(const JsonObject& root, bool moves, const CameraReading& how) const;

    glm::dmat3 m_turn{1}, m_inverse{1}; // m_turn removes the transform from rotations, m_inverse from positions
    glm::dvec3 m_shift{0};
    double m_scale = 1;
    bool m_undo = false;
};

} // namespace gsc
