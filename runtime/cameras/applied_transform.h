// SPDX-License-Identifier: Apache-2.0
// nerfstudio's applied_transform and applied_scale: how the poses of a file were moved away from those of the model that
// they came from, position = scale * (transform * original position).
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <glm/mat4x4.hpp>

#include <optional>

namespace gsc {

// Transforms a camera-to-world matrix of `root`'s frames back if that is asked for, else returns it unchanged; notes
// that in `how`. A transform that scales changes positions alone: cameras stay rigid. Throws Error(InvalidFile) for
// keys that are no such values; Error(Unsupported) for a transform to undo that stretches or mirrors.
class AppliedTransform {
public:
    AppliedTransform(const JsonObject& root, const CameraReading& how);

    [[nodiscard]] glm::dmat4 undone(const glm::dmat4& camera_to_world) const;

private:
    void tellKept(const JsonObject& root, bool moves, const CameraReading& how) const;

    glm::dmat3 m_turn{1}, m_inverse{1}; // takes the transform off rotations; off positions
    glm::dvec3 m_shift{0};
    double m_scale = 1;
    bool m_undo = false;
};

} // namespace gsc
