// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/applied_transform.h"
#include "runtime/cameras/camera_fields.h"
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/lens_angles.h"

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

// Keys that say nothing of poses and lenses, as instant-ngp, nerfstudio and others write them, stand behind those read.
constexpr auto kTransformsFrame = withDistortionKeys({"file_path",
                                                      "transform_matrix",
                                                      "w",
                                                      "h",
                                                      "cx",
                                                      "cy",
                                                      "camera_angle_x",
                                                      "camera_angle_y",
                                                      "fl_x",
                                                      "fl_y",
                                                      "x_fov",
                                                      "y_fov",
                                                      "rotation",
                                                      "mask_path",
                                                      "depth_file_path",
                                                      "depth_path",
                                                      "sharpness",
                                                      "colmap_im_id",
                                                      "time",
                                                      "fisheye_crop_radius",
                                                      "semantics_path",
                                                      "normal_path",
                                                      "driver_parameters"});
constexpr auto kTransformsRoot = withDistortionKeys({"frames",
                                                     "w",
                                                     "h",
                                                     "cx",
                                                     "cy",
                                                     "camera_angle_x",
                                                     "camera_angle_y",
                                                     "fl_x",
                                                     "fl_y",
                                                     "x_fov",
                                                     "y_fov",
                                                     "applied_transform",
                                                     "applied_scale",
                                                     "n_frames",
                                                     "aabb",
                                                     "aabb_scale",
                                                     "render_aabb",
                                                     "ply_file_path",
                                                     "fisheye_crop_radius",
                                                     "integer_depth_scale",
                                                     "depth_unit_scale_factor",
                                                     "enable_depth_loading",
                                                     "enable_ray_loading",
                                                     "white_transparent",
                                                     "black_transparent",
                                                     "mask_color",
                                                     "sharpness_discard_threshold",
                                                     "n_extra_learnable_dims",
                                                     "envmap",
                                                     "fix_premult",
                                                     "importance_sampling",
                                                     "sharpen",
                                                     "up"});
constexpr std::string_view kPathRoot[] = {
    "camera_path", "render_width",           "render_height", "camera_type",     "crop", "fps", "seconds", "keyframes",
    "default_fov", "default_transition_sec", "is_cycle",      "smoothness_value"};
constexpr std::string_view kPathEntry[] = {"camera_to_world", "fov", "aspect", "render_time"};

constexpr double kMostFar = 1e15;
constexpr double kSameAspect = 0.01;   // relative; widths and heights are whole pixels
constexpr double kLastRowError = 1e-4; // of a matrix that somebody inverted in fp32 or printed with few digits

// Three or four rows of four numbers, or all sixteen in one array, row by row.
glm::dmat4 readMatrix(const JsonObject& object, const char* key)
{
    const ParsedJson& value = object.at(key);
    double entries[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    if (value.is_array() && value.size() == 16)
        object.numbers(key, 16, entries);
    else
        object.matrix(key, value.is_array() && value.size() == 3 ? 3 : 4, 4, entries);
    return transpose(glm::make_mat4(entries)); // from rows
}

// With 0 0 0 1 as the last row, from which rounding may have led away a little. A last entry that is another number
// divides the place, as MatrixCity's files need it.
glm::dmat4 readPose(const JsonObject& frame, const char* key)
{
    glm::dmat4 m = readMatrix(frame, key);
    const double last[4] = {m[0][3], m[1][3], m[2][3], m[3][3]};
    const double slack = kLastRowError * std::abs(last[3]);
    if (std::abs(last[0]) > slack || std::abs(last[1]) > slack || std::abs(last[2]) > slack || last[3] == 0)
        frame.fail(key, formatString("ending in %g %g %g %g", last[0], last[1], last[2], last[3]),
                   "a last row of 0 0 0 1");
    if (std::abs(last[3] - 1) > kLastRowError)
        m[3] /= last[3];
    m[0][3] = m[1][3] = m[2][3] = 0;
    m[3][3] = 1;
    return m;
}

// Upstream inverts the 4x4 matrix after turning OpenGL axes into COLMAP's; a uniform scale in it survives, as
// MatrixCity's files have one.
void poseFromOpenGl(const JsonObject& frame, const char* key, const glm::dmat4& m, Camera& camera)
{
    const glm::dmat3 c2w{m[0], -m[1], -m[2]};
    const glm::dvec3 position(m[3]);
    const double det = determinant(c2w);
    const double scale2 = std::cbrt(det) * std::cbrt(det);
    for (int i = 0; i < 3; ++i)
        if (!(std::abs(position[i]) <= kMostFar))
            frame.fail(key, formatString("at %g along axis %d", position[i], i),
                       "a place at most 1e15 from the origin");
    if (!(det > 0) || !(1 / det < 1e30) || !(orthogonalityError(c2w, scale2) < kRotationTolerance * scale2))
        frame.fail(key, formatString("no rotation (determinant %g)", det),
                   "a right-handed rotation, uniformly scaled at most");
    // the inverse of s R is R^T / s; its transpose is what Camera stores
    const glm::dmat3 rows = transpose(c2w / scale2);
    std::copy_n(glm::value_ptr(rows), 9, camera.rotation);
    translationFromPosition(camera.rotation, glm::value_ptr(position), camera.translation);
}

// The size of the photograph, where both sides are stated.
void readSize(const LensKeys& lens, Camera& camera)
{
    const JsonObject* width = lens.holder("w");
    const JsonObject* height = lens.holder("h");
    if (width)
        camera.width = width->imageSide("w");
    if (height)
        camera.height = height->imageSide("h");
    if (width && height)
        return;
    camera.width = camera.height = 0;
    if (width || height)
        lens.notes->add("half a size", lens.frame.where(),
                        formatString("key \"%s\" is there without \"%s\"; the image is taken to have no size",
                                     width ? "w" : "h", width ? "h" : "w"));
}

// instant-ngp leaves the frames behind so many out.
void tellOfCount(const JsonObject& root, const CameraReading& how)
{
    const ParsedJson* const count = root.find("n_frames");
    if (count && *count != root.at("frames").size())
        how.warn(formatString("%s: key \"n_frames\" is %s and %zu frames are there; all of them are cameras",
                              root.where().c_str(), shownJson(*count).c_str(), root.at("frames").size()));
}

} // namespace

std::vector<Camera> transformsCameras(const JsonObject& root, const std::string& file, const CameraReading& how)
{
    const AppliedTransform applied(root, how);
    tellOfCount(root, how);
    const auto read = [&](const JsonObject& frame, CameraFindings& found, size_t) {
        const LensKeys lens{frame, &root, &found.notes};
        found.distortion.add(lens); // first: a panorama has no focal length
        Camera camera;
        camera.name = imageName(frame.text("file_path"));
        poseFromOpenGl(frame, "transform_matrix", applied.undone(readPose(frame, "transform_matrix")), camera);
        readSize(lens, camera);
        readLensAngles(lens, camera);
        const MiddleOffset middle = readMiddleOffset(lens, camera.width, camera.height);
        if (camera.width > 0) {
            finishCamera(camera, 0, 0, 0);
            setMiddle(camera, middle.x / camera.width, middle.y / camera.height);
        }
        noteUnusual(camera, frame.where(), found.notes);
        return camera;
    };
    return readEach({root.at("frames"), file, "frame", kTransformsFrame, &root, kTransformsRoot}, how, read);
}

// What nerfstudio's viewer saves of a path: matrices of 16 numbers in OpenGL axes, vertical angles in degrees.
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const std::string& file, const CameraReading& how)
{
    if (root.stated("camera_type") && root.text("camera_type") != "perspective" &&
        root.text("camera_type") != "PERSPECTIVE")
        throw Error(ErrorCode::Unsupported, file + ": \"camera_type\" is " + root.text("camera_type").substr(0, 40) +
                                                ", expected perspective; save the path as one");
    if (const ParsedJson* crop = root.find("crop"); crop && !crop->is_null())
        how.warn(file + ": key \"crop\" is not read; the whole scene is drawn");
    const uint32_t width = root.imageSide("render_width"), height = root.imageSide("render_height");
    const auto read = [&](const JsonObject& frame, CameraFindings& found, size_t i) {
        Camera camera;
        camera.name = formatString("%04zu", i);
        poseFromOpenGl(frame, "camera_to_world", readPose(frame, "camera_to_world"), camera);
        camera.width = width;
        camera.height = height;
        camera.fov_y = readDegrees(frame, "fov");
        camera.fov_x = 2 * std::atan(std::tan(camera.fov_y / 2) * width / height);
        if (frame.has("aspect")) {
            const double aspect = frame.number("aspect"), drawn = double(width) / height;
            if (!(std::abs(aspect - drawn) <= kSameAspect * drawn))
                found.notes.add("aspect", frame.where(),
                                formatString("key \"aspect\" is %g and the picture is %u x %u; pixels are taken as "
                                             "square and \"fov\" as its height",
                                             aspect, width, height));
        }
        return camera;
    };
    return readEach({root.at("camera_path"), file, "entry", kPathEntry, &root, kPathRoot}, how, read);
}

} // namespace gsc
