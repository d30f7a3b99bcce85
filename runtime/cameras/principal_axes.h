// SPDX-License-Identifier: Apache-2.0
// Finds the directions along which points, or directions, vary most and least.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace gsc {

// Eigenvectors and eigenvalues of a symmetric matrix, the largest first. The signs depend on the axes alone, not on
// how they were computed.
struct PrincipalAxes {
    glm::dvec3 axes[3];
    double values[3];
};
PrincipalAxes principalAxes(glm::dmat3 m);

} // namespace gsc
