// SPDX-License-Identifier: Apache-2.0
// What the readers of camera files of JSON share.
#pragma once

#include "player/cameras/camera_lens.h"
#include "runtime/camera.h"

#include <glm/mat3x3.hpp>

#include <string>
#include <utility>
#include <vector>

namespace gsc {

constexpr double kRotationTolerance = 1e-3; // files with six printed digits pass, scaled or sheared matrices do not

// Largest deviation of m^T m from `scale2` times the identity.
double orthogonalityError(const glm::dmat3& m, double scale2);

// A focal length in pixels; outside its bounds the tangents of the view leave fp32.
double readFocal(const JsonObject& object, const char* key);
double readAngle(const JsonObject& object, const char* key); // radians

// Moves the image so that its middle lies these shares of its sides right and down of the axis. Precondition: the
// camera's angles are known.
void setMiddle(Camera& camera, double share_x, double share_y);

// What `read` makes of each object of an array; `what` it is, for messages.
template <typename Read>
auto readEach(const ParsedJson& array, const std::string& file, const char* what, std::vector<std::string>* ignored,
              const Read& read)
{
    DistortionCheck distortion(file, ignored);
    std::vector<decltype(read(std::declval<JsonObject&>(), distortion, 0))> cameras;
    cameras.reserve(array.size());
    for (size_t i = 0; i < array.size(); ++i) {
        JsonObject object(array[i], formatString("%s: %s %zu", file.c_str(), what, i));
        cameras.push_back(read(object, distortion, i));
    }
    distortion.finish();
    return cameras;
}

// The cameras of a transforms*.json and of nerfstudio's camera_path.json, whose axes are OpenGL's.
std::vector<Camera> transformsCameras(const JsonObject& root, const std::string& file,
                                      std::vector<std::string>* ignored);
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const std::string& file,
                                      std::vector<std::string>* ignored);

} // namespace gsc
