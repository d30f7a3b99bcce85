// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_reading.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

void translationFromPosition(const double rotation[9], const double position[3], double out[3])
{
    // make_mat3() reads the row-major matrix column by column, which gives the transpose
    const glm::dvec3 translation = -(glm::make_mat3(rotation) * glm::make_vec3(position));
    std::copy_n(glm::value_ptr(translation), 3, out);
}

double angleOf(double pixels, double focal)
{
    return 2 * std::atan(pixels / (2 * focal));
}

void setMiddle(Camera& camera, double share_x, double share_y)
{
    camera.tan_mid_x = 2 * share_x * std::tan(camera.fov_x / 2);
    camera.tan_mid_y = 2 * share_y * std::tan(camera.fov_y / 2);
}

std::string imageName(const std::string& path)
{
    const std::string file = path.substr(path.find_last_of("/\\") + 1);
    return file.substr(0, file.find('.', 1));
}

} // namespace gsc
