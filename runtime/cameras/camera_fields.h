// SPDX-License-Identifier: Apache-2.0
// What the readers of camera files of JSON share.
#pragma once

#include "runtime/cameras/camera_lens.h"
#include <gsc/camera.h>

#include <glm/mat3x3.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gsc {

constexpr double kRotationTolerance = 1e-3; // files with six printed digits pass, scaled or sheared matrices do not

// Largest deviation of m^T m from `scale2` times the identity.
double orthogonalityError(const glm::dmat3& m, double scale2);

// A focal length in pixels; outside its bounds the tangents of the view leave fp32.
double readFocal(const JsonObject& object, const char* key);
double readAngle(const JsonObject& object, const char* key);   // radians
double readDegrees(const JsonObject& object, const char* key); // the file's; returns radians

// Moves the image so that its middle lies these shares of its sides right and down of the axis. Precondition: the
// camera's angles are known.
void setMiddle(Camera& camera, double share_x, double share_y);

// Tells `notes` of a lens that is possible and seldom meant: an axis outside the image, an angle close to a half turn.
void noteUnusual(const Camera& camera, const std::string& where, CameraNotes& notes);

// What the cameras of a file say beside their poses.
struct CameraFindings {
    DistortionCheck distortion;
    CameraNotes notes;

    CameraFindings(const std::string& file, const CameraReading& how) : distortion(file, how), notes(file) {}
    // After the last camera.
    void tell(const CameraReading& how)
    {
        distortion.finish();
        for (const std::string& text : notes.sentences())
            how.warn(text);
    }
};

// What `read` makes of each object of an array; `what` it is, for messages. `root`, if given, is the object that holds the
// array; keys of neither kind that are not in `known` are named.
struct ArrayOfCameras {
    const ParsedJson& array;
    const std::string& file;
    const char* what;
    std::span<const std::string_view> known;
    const JsonObject* root = nullptr;
    std::span<const std::string_view> known_of_root = {};
};
template <typename Read>
auto readEach(const ArrayOfCameras& from, const CameraReading& how, const Read& read)
{
    CameraFindings found(from.file, how);
    if (from.root)
        found.notes.addUnread(*from.root, from.known_of_root);
    std::vector<decltype(read(std::declval<JsonObject&>(), found, 0))> cameras;
    cameras.reserve(from.array.size());
    for (size_t i = 0; i < from.array.size(); ++i) {
        JsonObject object(from.array[i], formatString("%s: %s %zu", from.file.c_str(), from.what, i));
        found.notes.addUnread(object, from.known);
        cameras.push_back(read(object, found, i));
    }
    found.tell(how);
    return cameras;
}

// `own` and what DistortionCheck reads.
template <size_t N>
constexpr std::array<std::string_view, N + kDistortionKeys.size()> withDistortionKeys(const std::string_view (&own)[N])
{
    std::array<std::string_view, N + kDistortionKeys.size()> all;
    std::copy_n(own, N, all.begin());
    std::copy(kDistortionKeys.begin(), kDistortionKeys.end(), all.begin() + N);
    return all;
}

// The cameras of a transforms*.json and of nerfstudio's camera_path.json, whose axes are OpenGL's.
std::vector<Camera> transformsCameras(const JsonObject& root, const std::string& file, const CameraReading& how);
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const std::string& file, const CameraReading& how);

} // namespace gsc
