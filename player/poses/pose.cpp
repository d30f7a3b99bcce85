// SPDX-License-Identifier: Apache-2.0
#include "player/poses/pose.h"

#include "runtime/cameras/camera_file.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kRoundedRotation = 1e-3; // tolerance that the reader of camera files uses too

bool isFiniteVector(const glm::dvec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

} // namespace

glm::dmat3 orthonormal(const glm::dmat3& axes)
{
    const glm::dvec3 forward = normalize(axes[2]), right = normalize(cross(axes[1], forward));
    return {right, cross(forward, right), forward};
}

bool isFinite(const CameraPose& pose)
{
    return isFiniteVector(pose.position) && isFiniteVector(pose.axes[0]) && isFiniteVector(pose.axes[1]) &&
           isFiniteVector(pose.axes[2]);
}

bool hasRotation(const Camera& camera)
{
    // make_mat3() reads the row-major matrix column by column, so its columns are right, down and forward
    const glm::dmat3 rows = glm::make_mat3(camera.rotation);
    const glm::dmat3 off = rows * transpose(rows) - glm::dmat3(1.0);
    const double* const entries = glm::value_ptr(off);
    return determinant(rows) > 0 &&
           std::all_of(entries, entries + 9, [](double e) { return std::abs(e) < kRoundedRotation; });
}

std::optional<CameraPose> poseOf(const Camera& camera)
{
    const glm::dmat3 to_view = glm::make_mat3(camera.rotation);
    CameraPose pose;
    pose.position = -(inverse(to_view) * glm::make_vec3(camera.translation));
    pose.axes = orthonormal(transpose(to_view));
    if (!isFinite(pose) || !(determinant(to_view) > 0))
        return std::nullopt;
    return pose;
}

void setPose(const CameraPose& pose, Camera& camera)
{
    const glm::dmat3 rows = transpose(pose.axes);
    std::copy_n(glm::value_ptr(rows), 9, camera.rotation);
    translationFromPosition(camera.rotation, glm::value_ptr(pose.position), camera.translation);
}

CameraPose between(const CameraPose& from, const CameraPose& to, double share)
{
    if (!(share > 0))
        return from;
    if (share >= 1)
        return to;
    const glm::dquat turn = slerp(glm::quat_cast(from.axes), glm::quat_cast(to.axes), share);
    return {from.position + (to.position - from.position) * share, orthonormal(glm::mat3_cast(turn))};
}

} // namespace gsc
