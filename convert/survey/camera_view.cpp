// SPDX-License-Identifier: Apache-2.0
#include "convert/survey/camera_view.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace gsc {

namespace {

constexpr double kNear = 0.2; // the trainers' near plane in world units

} // namespace

SourceCamera lookingAlong(dvec3 position, dvec3 forward, dvec3 up, uint32_t width, uint32_t height, double fov_x)
{
    SourceCamera camera;
    camera.width = width;
    camera.height = height;
    const dvec3 right = normalized(cross(forward, up)), down = cross(forward, right);
    const glm::dmat3 rows = transpose(glm::dmat3(right, down, forward));
    std::copy_n(glm::value_ptr(position), 3, camera.position);
    std::copy_n(glm::value_ptr(rows), 9, camera.rotation);
    // equals 1 / tan(fov_x / 2), but is exact for a right angle
    camera.fx = camera.fy = 0.5 * width * (1 + std::cos(fov_x)) / std::sin(fov_x);
    return camera;
}

dvec3 eyeOf(const SourceCamera& camera)
{
    return glm::make_vec3(camera.position);
}

dvec3 axisOf(const SourceCamera& camera, int column)
{
    return {camera.rotation[column], camera.rotation[3 + column], camera.rotation[6 + column]};
}

bool sees(const SourceCamera& camera, dvec3 p, double share)
{
    // multiplies with the rows of the rotation as columns, which is the inverse
    const dvec3 view = glm::make_mat3(camera.rotation) * (p - eyeOf(camera));
    return view.z > kNear && std::abs(view.x) * camera.fx <= view.z * 0.5 * (share * camera.width) &&
           std::abs(view.y) * camera.fy <= view.z * 0.5 * (share * camera.height);
}

bool wellSeen(std::span<const SourceCamera> cameras, uint32_t least, dvec3 p)
{
    uint32_t count = 0;
    for (const SourceCamera& camera : cameras)
        if (sees(camera, p) && ++count >= least)
            return true;
    return least == 0;
}

} // namespace gsc
