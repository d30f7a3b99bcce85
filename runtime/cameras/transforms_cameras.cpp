// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/transforms_cameras.h"

#include "format/numbers/count_text.h"
#include "runtime/cameras/applied_transform.h"
#include "runtime/cameras/camera_fields.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace gsc {

namespace {

constexpr const char* kLensKeys[] = {"w",    "h",    "cx",    "cy",   "camera_angle_x", "camera_angle_y",
                                     "fl_x", "fl_y", "x_fov", "y_fov"};
// Known keys of a frame and of the whole file: first those that are read, then those of instant-ngp, nerfstudio and
// others that concern neither poses nor lenses.
constexpr const char* kFrame[] = {
    "file_path",      "transform_matrix", "rotation",         "mask_path", "depth_file_path",
    "depth_path",     "sharpness",        "colmap_im_id",     "time",      "fisheye_crop_radius",
    "semantics_path", "normal_path",      "driver_parameters"};
constexpr const char* kRoot[] = {
    "frames",        "applied_transform",    "applied_scale",           "n_frames",   "sharpness_discard_threshold",
    "fix_premult",   "fisheye_crop_radius",  "enable_ray_loading",      "aabb",       "n_extra_learnable_dims",
    "ply_file_path", "integer_depth_scale",  "depth_unit_scale_factor", "mask_color", "envmap",
    "aabb_scale",    "enable_depth_loading", "white_transparent",       "up",         "render_aabb",
    "sharpen",       "importance_sampling",  "black_transparent"};
constexpr auto kTransformsFrame = joinKeys(kProjectionKeys, kCoefficients, kLensKeys, kFrame);
constexpr auto kTransformsRoot = joinKeys(kProjectionKeys, kCoefficients, kLensKeys, kRoot);
constexpr const char* kPathRoot[] = {
    "camera_path", "render_width",           "render_height", "camera_type",     "crop", "fps", "seconds", "keyframes",
    "default_fov", "default_transition_sec", "is_cycle",      "smoothness_value"};
constexpr const char* kPathEntry[] = {"camera_to_world", "fov", "aspect", "render_time"};

constexpr double kMostFar = 1e15;
constexpr double kSameAspect = 0.01; // relative tolerance between aspect ratios; widths and heights are whole pixels
// largest error in the last row of a matrix that was inverted in fp32 or printed with few digits
constexpr double kLastRowError = 1e-4;

// Reads a matrix of three or four rows of four numbers, or of all sixteen in one array, row by row.
glm::dmat4 readMatrix(const JsonObject& object, const char* key)
{
    const ParsedJson& value = object.at(key);
    double entries[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    if (value.is_array() && value.size() == 16)
        object.numbers(key, 16, entries);
    else
        object.matrix(key, value.is_array() && value.size() == 3 ? 3 : 4, 4, entries);
    return transpose(glm::make_mat4(entries)); // the numbers are row by row, glm's matrices column by column
}

// Reads a camera-to-world matrix and sets the last row to 0 0 0 1, from which it may differ by rounding. If the last
// entry is another number, the position is divided by it, as MatrixCity's files need it.
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

// Sets the pose from a matrix in OpenGL's axes. The trainers turn the axes into COLMAP's and then invert the 4x4
// matrix; a uniform scale in it, as in MatrixCity's files, is kept.
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
    // the inverse of s R is R^T / s, and Camera stores the transpose of that
    const glm::dmat3 rows = transpose(c2w / scale2);
    std::copy_n(glm::value_ptr(rows), 9, camera.rotation);
    translationFromPosition(camera.rotation, glm::value_ptr(position), camera.translation);
}

// Reads the size of the photograph; 0 unless both sides are stated.
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

// relative tolerance between focal lengths; six printed digits of an angle are closer
constexpr double kSameFocal = 1e-4;
// relative tolerance within which an angle and a focal length agree, one computed from the other
constexpr double kSameView = 1e-3;

enum class AngleUnit : uint8_t { Radians, Pixels, Degrees };

struct AngleKey {
    const char* x;
    const char* y;
    AngleUnit unit;
};
constexpr AngleKey kRadians{"camera_angle_x", "camera_angle_y", AngleUnit::Radians};
constexpr AngleKey kPixels{"fl_x", "fl_y", AngleUnit::Pixels};
constexpr AngleKey kDegrees{"x_fov", "y_fov", AngleUnit::Degrees};
// Order of preference if the size is known; instant-ngp and nerfstudio have the same. The focal length comes first
// because BlenderNeRF's camera_angle_y belongs to the sensor, not to the picture.
constexpr AngleKey kOfSize[] = {kPixels, kRadians, kDegrees};
// Order of preference if the size is not known: an angle then says more than a focal length in pixels.
constexpr AngleKey kOfNoSize[] = {kRadians, kPixels, kDegrees};

// Value of one key: an angle, or a focal length in pixels.
struct StatedAngle {
    const char* key = nullptr;
    const JsonObject* holder = nullptr;
    double radians = 0, pixels = 0; // angle or focal length: one of them is stated, the other is 0

    // Returns the focal length in pixels for a side of `side` pixels. None if an angle is stated and `side` is not
    // known (0).
    [[nodiscard]] std::optional<double> focal(uint32_t side) const
    {
        if (pixels > 0)
            return pixels;
        if (side == 0)
            return std::nullopt;
        return side / (2 * std::tan(radians / 2));
    }
};

StatedAngle readStated(const JsonObject& holder, const char* key, AngleUnit unit)
{
    StatedAngle stated{key, &holder};
    if (unit == AngleUnit::Pixels)
        stated.pixels = readFocal(holder, key);
    else if (unit == AngleUnit::Radians)
        stated.radians = readAngle(holder, key);
    else
        stated.radians = readDegrees(holder, key);
    return stated;
}

void noteDisagreement(const LensKeys& lens, const StatedAngle& taken, const StatedAngle& other, uint32_t side)
{
    std::optional<double> a = taken.focal(side), b = other.focal(side);
    if (taken.pixels == 0 && other.pixels == 0) // two angles can be compared even if the size is not known
        a = 1 / std::tan(taken.radians / 2), b = 1 / std::tan(other.radians / 2);
    const double slack = (taken.pixels > 0) == (other.pixels > 0) ? kSameFocal : kSameView;
    if (a && b && std::abs(*a - *b) <= slack * *a)
        return;
    const auto source = [&](const StatedAngle& s) { return s.holder == &lens.frame ? "" : " of the whole file"; };
    lens.notes->add(std::string("angles ") + taken.key + other.key + source(other), lens.frame.where(),
                    formatString("keys \"%s\"%s (%s) and \"%s\"%s (%s) do not say the same; the first is taken",
                                 taken.key, source(taken), shownJson(taken.holder->at(taken.key)).c_str(), other.key,
                                 source(other), shownJson(other.holder->at(other.key)).c_str()));
}

// Chooses the key for one axis, by the order of preference; the result has no key if none is there.
StatedAngle angleOfAxis(const LensKeys& lens, const char* AngleKey::*axis, uint32_t side)
{
    StatedAngle taken;
    for (const JsonObject* holder : {&lens.frame, lens.file})
        for (const AngleKey& key : side > 0 ? kOfSize : kOfNoSize) {
            if (holder == nullptr || !holder->has(key.*axis))
                continue;
            const StatedAngle stated = readStated(*holder, key.*axis, key.unit);
            if (taken.key == nullptr)
                taken = stated;
            else if (lens.notes)
                noteDisagreement(lens, taken, stated, side);
        }
    return taken;
}

// Sets the angles or focal lengths of `camera`, whose size has been read, from camera_angle_x, fl_x, x_fov (degrees),
// and the same keys of y. A frame's keys are preferred to the file's; a focal length to an angle if the size is known.
// lens.notes receives keys that disagree. If one axis is missing, pixels are square. Throws Error(InvalidFile), also
// if no key is there.
void readLensAngles(const LensKeys& lens, Camera& camera)
{
    const StatedAngle x = angleOfAxis(lens, &AngleKey::x, camera.width);
    const StatedAngle y = angleOfAxis(lens, &AngleKey::y, camera.height);
    if (x.key == nullptr && y.key == nullptr)
        throw Error(ErrorCode::InvalidFile, lens.frame.where(), "neither \"camera_angle_x\" nor \"fl_x\" is there",
                    "one of them in the frame or in the file", "add one, or export the cameras again");
    const StatedAngle& first = x.key ? x : y;
    if (first.pixels > 0 && (y.key == nullptr || y.pixels > 0)) {
        camera.focal_x = first.pixels;
        camera.focal_y = y.key ? y.pixels : first.pixels;
        return;
    }
    const bool comparable = camera.width > 0 || (x.pixels == 0 && y.pixels == 0);
    if (!comparable && x.key && y.key)
        lens.notes->add("mixed", lens.frame.where(),
                        formatString("key \"%s\" is in other units than \"%s\" and the image has no size to compare "
                                     "them by; \"%s\" is ignored and pixels are taken as square",
                                     y.key, x.key, y.key));
    const auto radians = [](const StatedAngle& s, uint32_t side) {
        return s.pixels > 0 ? 2 * std::atan(side / (2 * s.pixels)) : s.radians;
    };
    if (!comparable) {
        camera.focal_x = camera.focal_y = x.pixels;
        camera.fov_x = x.radians;
        return;
    }
    if (x.key)
        camera.fov_x = radians(x, camera.width);
    if (y.key)
        camera.fov_y = radians(y, camera.height);
}

// Warns if the number of frames differs from n_frames: instant-ngp leaves out the frames beyond it.
void tellOfCount(const JsonObject& root, const CameraReading& how)
{
    const ParsedJson* const count = root.find("n_frames");
    if (count && *count != root.at("frames").size())
        how.warn(formatString("%s: key \"n_frames\" is %s and the file has %s; every one is a camera",
                              root.where().c_str(), shownJson(*count).c_str(),
                              formatCount(root.at("frames").size(), "frame").c_str()));
}

} // namespace

std::vector<Camera> transformsCameras(const JsonObject& root, const CameraReading& how)
{
    const AppliedTransform applied(root, how);
    tellOfCount(root, how);
    const auto read = [&](const JsonObject& frame, CameraFindings& found, size_t) {
        const LensKeys lens{frame, &root, &found.notes};
        found.distortion.add(lens); // checked before the focal length, which a panorama does not have
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
    return readEach({root.at("frames"), root.where(), "frame", kTransformsFrame, &root, kTransformsRoot}, how, read);
}

// Reads a path of nerfstudio's viewer: matrices of 16 numbers in OpenGL's axes, vertical angles in degrees.
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const CameraReading& how)
{
    if (root.stated("camera_type") && root.text("camera_type") != "perspective" &&
        root.text("camera_type") != "PERSPECTIVE")
        throw Error(ErrorCode::Unsupported, root.where(),
                    "\"camera_type\" is " + root.text("camera_type").substr(0, 40), "perspective",
                    "save the path as one");
    if (const ParsedJson* crop = root.find("crop"); crop && !crop->is_null())
        how.warn(root.where() + ": key \"crop\" is not read; the whole scene is drawn");
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
    return readEach({root.at("camera_path"), root.where(), "entry", kPathEntry, &root, kPathRoot}, how, read);
}

} // namespace gsc
