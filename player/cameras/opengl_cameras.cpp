// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/camera_fields.h"
#include "player/cameras/camera_file.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

namespace {

// File name without folders, cut at the first dot, as upstream names images.
std::string imageName(std::string path)
{
    const size_t slash = path.find_last_of("/\\");
    if (slash != std::string::npos)
        path.erase(0, slash + 1);
    return path.substr(0, path.find('.', 1));
}

// Upstream inverts the 4x4 matrix after turning OpenGL axes into COLMAP's; a uniform scale in it survives, as
// MatrixCity's files have one.
void poseFromOpenGl(const JsonObject& frame, const char* key, const double (&entries)[16], Camera& camera)
{
    const glm::dmat4 m = transpose(glm::make_mat4(entries)); // from rows
    const double* const last = entries + 12;
    if (last[0] != 0 || last[1] != 0 || last[2] != 0 || last[3] == 0)
        frame.fail(key, formatString("ending in %g %g %g %g", last[0], last[1], last[2], last[3]),
                   "a last row of 0 0 0 1");
    const glm::dmat3 c2w{m[0], -m[1], -m[2]};
    const glm::dvec3 position = glm::dvec3(m[3]) / last[3];
    const double det = determinant(c2w);
    const double scale2 = std::cbrt(det) * std::cbrt(det);
    if (!(det > 0) || !(1 / det < 1e30) || !(orthogonalityError(c2w, scale2) < kRotationTolerance * scale2))
        frame.fail(key, formatString("no rotation (determinant %g)", det),
                   "a right-handed rotation, uniformly scaled at most");
    // the inverse of s R is R^T / s; its transpose is what Camera stores
    const glm::dmat3 rows = transpose(c2w / scale2);
    std::copy_n(glm::value_ptr(rows), 9, camera.rotation);
    translationFromPosition(camera.rotation, glm::value_ptr(position), camera.translation);
}

} // namespace

std::vector<Camera> transformsCameras(const JsonObject& root, const std::string& file,
                                      std::vector<std::string>* ignored)
{
    const auto read = [&root](const JsonObject& frame, DistortionCheck& distortion, size_t) {
        const LensKeys lens{frame, &root};
        Camera camera;
        camera.name = imageName(frame.text("file_path"));
        double entries[16];
        frame.matrix("transform_matrix", 4, 4, entries);
        poseFromOpenGl(frame, "transform_matrix", entries, camera);
        const JsonObject* width = lens.holder("w");
        const JsonObject* height = lens.holder("h");
        if (width && height) {
            camera.width = width->imageSide("w");
            camera.height = height->imageSide("h");
        }
        if (const JsonObject* angle = lens.holder("camera_angle_x")) {
            camera.fov_x = readAngle(*angle, "camera_angle_x");
        } else if (const JsonObject* fx = lens.holder("fl_x")) {
            const JsonObject* fy = lens.holder("fl_y");
            camera.focal_x = readFocal(*fx, "fl_x");
            camera.focal_y = fy ? readFocal(*fy, "fl_y") : camera.focal_x;
        } else {
            throw Error(ErrorCode::InvalidFile,
                        formatString("%s: neither \"camera_angle_x\" nor \"fl_x\" is there, expected one of them in "
                                     "the frame or in the file; add one, or export the cameras again",
                                     frame.where().c_str()));
        }
        distortion.add(lens);
        const MiddleOffset middle = readMiddleOffset(lens, camera.width, camera.height);
        if (camera.width > 0) {
            finishCamera(camera, 0, 0, 0);
            setMiddle(camera, middle.x / camera.width, middle.y / camera.height);
        }
        return camera;
    };
    return readEach(root.at("frames"), file, "frame", ignored, read);
}

// What nerfstudio's viewer saves of a path: matrices of 16 numbers in OpenGL axes, vertical angles in degrees.
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const std::string& file,
                                      std::vector<std::string>* ignored)
{
    if (root.has("camera_type") && root.text("camera_type") != "perspective")
        throw Error(ErrorCode::Unsupported, file + ": \"camera_type\" is " + root.text("camera_type").substr(0, 40) +
                                                ", expected perspective; save the path as one");
    const uint32_t width = root.imageSide("render_width"), height = root.imageSide("render_height");
    const auto read = [&](const JsonObject& frame, DistortionCheck&, size_t i) {
        Camera camera;
        camera.name = formatString("%04zu", i);
        const ParsedJson& values = frame.at("camera_to_world");
        double entries[16];
        if (!values.is_array() || values.size() != 16 || !std::ranges::all_of(values, [](const ParsedJson& v) {
                return v.is_number() && std::isfinite(v.get<double>());
            }))
            frame.fail("camera_to_world", "something else", "16 numbers, row by row");
        std::ranges::transform(values, entries, [](const ParsedJson& v) { return v.get<double>(); });
        poseFromOpenGl(frame, "camera_to_world", entries, camera);
        const double degrees = frame.number("fov");
        if (!(degrees >= 1e-4 && degrees < 180 - 1e-4))
            frame.fail("fov", formatString("%g", degrees), "an angle in degrees between 0 and 180");
        camera.width = width;
        camera.height = height;
        camera.fov_y = degrees * std::numbers::pi / 180;
        camera.fov_x = 2 * std::atan(std::tan(camera.fov_y / 2) * width / height);
        return camera;
    };
    return readEach(root.at("camera_path"), file, "entry", ignored, read);
}

} // namespace gsc
