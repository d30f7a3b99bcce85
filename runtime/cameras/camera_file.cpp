// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_file.h"

#include "runtime/cameras/camera_fields.h"
#include "runtime/cameras/camera_folder.h"
#include "runtime/cameras/colmap_cameras.h"
#include <gsc/file/read_file.h>
#include "runtime/cameras/json_fields.h"
#include "runtime/cameras/trainer_size.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <utility>

namespace gsc {

namespace {

constexpr double kWide = 170 * std::numbers::pi / 180; // radians
constexpr uint64_t kMaxFileBytes = uint64_t(1) << 30;
constexpr auto kUpstreamKeys =
    withDistortionKeys({"id", "img_name", "width", "height", "position", "rotation", "fx", "fy", "cx", "cy"});
constexpr auto kFrameKeys = withDistortionKeys({"name", "width", "height", "fov_x", "fov_y", "fx", "fy", "rotation",
                                                "position", "translation", "appearance", "time", "cx", "cy"});
constexpr auto kTrajectoryKeys =
    withDistortionKeys({"schema", "name", "description", "metre", "fps", "ipd", "views", "frames", "cx", "cy"});

void readRotation(const JsonObject& object, double out[9], const char* what = "camera-to-world")
{
    object.matrix("rotation", 3, 3, out);
    const glm::dmat3 rotation = transpose(glm::make_mat3(out)); // from rows
    const double error = orthogonalityError(rotation, 1), det = determinant(rotation);
    if (!(error < kRotationTolerance) || det < 0)
        object.fail("rotation", formatString("no rotation (determinant %g, columns off orthonormal by %g)", det, error),
                    formatString("an orthonormal, right-handed %s matrix", what));
}

double angleOf(double pixels, double focal)
{
    return 2 * std::atan(pixels / (2 * focal));
}

// Several cameras of one name are all kept, but who asks for one by name gets one of them.
void noteRepeats(const std::vector<SourceCamera>& cameras, const std::string& file, const CameraReading& how)
{
    std::map<std::string_view, size_t> seen;
    size_t repeats = 0;
    const SourceCamera* first = nullptr;
    for (const SourceCamera& camera : cameras)
        if (++seen[camera.name] == 2 && repeats++ == 0)
            first = &camera;
    if (first != nullptr)
        how.warn(
            formatString("%s: %zu names are of more than one camera (the first is %.60s); each of these is a camera "
                         "of its own here",
                         file.c_str(), repeats, first->name.c_str()));
}

std::vector<SourceCamera> upstreamCameras(const ParsedJson& root, const std::string& file, const CameraReading& how)
{
    if (!root.is_array())
        throw Error(ErrorCode::InvalidFile,
                    formatString(
                        "%s: the root is no array, expected the list of cameras that training writes; pass such a file",
                        file.c_str()));
    const auto read = [](JsonObject& entry, CameraFindings& found, size_t) {
        SourceCamera camera;
        camera.name = entry.text("img_name");
        entry.setWhere(entry.where() + formatString(" (%.60s)", camera.name.c_str()));
        camera.id = int(entry.integer("id", 0, INT32_MAX));
        camera.width = entry.imageSide("width");
        camera.height = entry.imageSide("height");
        entry.vector3("position", camera.position);
        readRotation(entry, camera.rotation);
        camera.fx = readFocal(entry, "fx");
        camera.fy = readFocal(entry, "fy");
        found.distortion.add({entry});
        const MiddleOffset middle = readMiddleOffset({entry}, camera.width, camera.height);
        camera.middle_x = middle.x;
        camera.middle_y = middle.y;
        noteUnusual(cameraOf(camera), entry.where(), found.notes);
        return camera;
    };
    std::vector<SourceCamera> cameras = readEach({root, file, "entry", kUpstreamKeys}, how, read);
    noteRepeats(cameras, file, how);
    return cameras;
}

void readLens(const JsonObject& frame, Camera& camera)
{
    if (frame.has("width") || frame.has("height")) {
        camera.width = frame.imageSide("width");
        camera.height = frame.imageSide("height");
    }
    const bool has_focal = frame.has("fx") || frame.has("fy");
    if (has_focal && (frame.has("fov_x") || frame.has("fov_y")))
        frame.fail("fx", "given together with a field of view", "either fx, fy or fov_x, fov_y");
    if (has_focal) {
        if (camera.width == 0)
            frame.fail("fx", "given without width and height", "both, because fx and fy are in pixels");
        camera.fov_x = angleOf(camera.width, readFocal(frame, "fx"));
        camera.fov_y = angleOf(camera.height, readFocal(frame, "fy"));
    } else {
        if (frame.has("fov_x"))
            camera.fov_x = readAngle(frame, "fov_x");
        if (frame.has("fov_y"))
            camera.fov_y = readAngle(frame, "fov_y");
    }
}

std::vector<Camera> trajectoryCameras(const JsonObject& root, const std::string& file, const CameraReading& how)
{
    const std::string schema = root.text("schema");
    if (schema != "gsc.trajectory/1")
        root.fail("schema", "\"" + schema.substr(0, 40) + "\"", "\"gsc.trajectory/1\"; a newer player may read it");
    const ParsedJson& frames = root.at("frames");
    if (!frames.is_array())
        root.fail("frames", "no array", "an array of frames");
    const auto read = [&root](const JsonObject& frame, CameraFindings& found, size_t i) {
        Camera camera;
        camera.name = frame.has("name") ? frame.text("name") : formatString("%04zu", i);
        readRotation(frame, camera.rotation);
        if (frame.has("position") == frame.has("translation"))
            throw Error(
                ErrorCode::InvalidFile,
                formatString(
                    "%s: %s of \"position\" and \"translation\" is there, expected exactly one; leave one of them in",
                    frame.where().c_str(), frame.has("position") ? "each" : "none"));
        if (frame.has("translation")) {
            frame.vector3("translation", camera.translation);
        } else {
            double position[3];
            frame.vector3("position", position);
            translationFromPosition(camera.rotation, position, camera.translation);
        }
        readLens(frame, camera);
        found.distortion.add({frame, &root, &found.notes});
        refuseMiddleOffset({frame, &root});
        if (frame.has("appearance"))
            camera.appearance = int(frame.integer("appearance", 0, INT32_MAX));
        if (frame.has("time"))
            (void)frame.number("time");
        return camera;
    };
    return readEach({frames, file, "frame", kFrameKeys, &root, kTrajectoryKeys}, how, read);
}

// A signed angle from the eye's forward axis.
double readSide(const JsonObject& fov, const char* key)
{
    const double angle = fov.number(key);
    if (!(std::abs(angle) < 0.5 * std::numbers::pi - 1e-6))
        fov.fail(key, formatString("%g", angle), "a signed angle in radians within a right angle, as in XrFovf");
    return angle;
}

constexpr std::string_view kViewKeys[] = {"fov", "pose"};
constexpr std::string_view kSideKeys[] = {"left", "right", "up", "down"};
constexpr std::string_view kPoseKeys[] = {"position", "rotation"};

std::vector<EyeView> trajectoryViews(const JsonObject& root, const std::string& file, const CameraReading& how)
{
    std::vector<EyeView> views;
    if (!root.has("views"))
        return views;
    const ParsedJson& array = root.at("views");
    if (!array.is_array() || array.empty() || array.size() > 2)
        root.fail("views", "no array of one or two", "one eye, or the left and the right one");
    if (root.has("ipd"))
        root.fail("ipd", "given together with \"views\"", "one of them; the views say where the eyes are");
    CameraNotes notes(file);
    for (size_t i = 0; i < array.size(); ++i) {
        const JsonObject eye(array[i], formatString("%s: view %zu", file.c_str(), i));
        const JsonObject fov(eye.at("fov"), eye.where() + ": fov");
        const JsonObject pose(eye.at("pose"), eye.where() + ": pose");
        EyeView view;
        view.left = readSide(fov, "left");
        view.right = readSide(fov, "right");
        view.up = readSide(fov, "up");
        view.down = readSide(fov, "down");
        if (!(view.right - view.left >= 1e-6))
            fov.fail("right", formatString("%g", view.right), formatString("more than left, which is %g", view.left));
        if (!(view.up - view.down >= 1e-6))
            fov.fail("up", formatString("%g", view.up), formatString("more than down, which is %g", view.down));
        pose.vector3("position", view.position);
        readRotation(pose, view.rotation, "eye-to-head");
        views.push_back(view);
        notes.addUnread(eye, kViewKeys);
        notes.addUnread(fov, kSideKeys);
        notes.addUnread(pose, kPoseKeys);
    }
    for (const std::string& text : notes.sentences())
        how.warn(text);
    return views;
}

// What a reader of cameras alone says to a trajectory with views.
[[noreturn]] void refuseViews(const std::string& name)
{
    throw Error(ErrorCode::Unsupported,
                name +
                    ": \"views\" gives the eyes lenses and places of their own, expected cameras here; gsc-play draws "
                    "such a trajectory, and without \"views\" its frames are cameras");
}

void warnOfNothingToUndo(const std::string& name, const CameraReading& how)
{
    if (how.transform == CamerasTransform::Undo)
        how.warn(name +
                 ": is of a kind that states no \"applied_transform\" to undo; its poses are taken as they stand");
}

} // namespace

double orthogonalityError(const glm::dmat3& m, double scale2)
{
    const glm::dmat3 off = transpose(m) * m - glm::dmat3(scale2);
    const double* const entries = glm::value_ptr(off);
    return std::accumulate(entries, entries + 9, 0.0, [](double a, double b) { return std::max(a, std::abs(b)); });
}

double readFocal(const JsonObject& object, const char* key)
{
    const double focal = object.positive(key);
    if (focal < 1e-3 || focal > 1e9)
        object.fail(key, formatString("%g", focal), "a focal length between 0.001 and 1e9 pixels");
    return focal;
}

double readAngle(const JsonObject& object, const char* key)
{
    const double angle = object.number(key);
    if (!(angle >= 1e-6 && angle < std::numbers::pi - 1e-6))
        object.fail(key, formatString("%g", angle), "an angle in radians between 0 and pi");
    return angle;
}

double readDegrees(const JsonObject& object, const char* key)
{
    const double degrees = object.number(key);
    if (!(degrees >= 1e-4 && degrees < 180 - 1e-4))
        object.fail(key, formatString("%g", degrees), "an angle in degrees between 0 and 180");
    return degrees * std::numbers::pi / 180;
}

void setMiddle(Camera& camera, double share_x, double share_y)
{
    camera.tan_mid_x = 2 * share_x * std::tan(camera.fov_x / 2);
    camera.tan_mid_y = 2 * share_y * std::tan(camera.fov_y / 2);
}

void noteUnusual(const Camera& camera, const std::string& where, CameraNotes& notes)
{
    const double widest = std::max(camera.fov_x, camera.fov_y);
    if (widest > kWide)
        notes.add(
            "wide", where,
            formatString("sees %g degrees, nearly a half turn, which is seldom meant; is the focal length in pixels "
                         "of that size?",
                         widest * 180 / std::numbers::pi));
    const double right = std::abs(camera.tan_mid_x) / std::tan(camera.fov_x / 2);
    const double down = std::abs(camera.tan_mid_y) / std::tan(camera.fov_y / 2);
    if (right > 1 || down > 1)
        notes.add("axis", where, "the axis (cx, cy) meets no pixel of the image, which is seldom meant; it is kept");
}

void translationFromPosition(const double rotation[9], const double position[3], double out[3])
{
    const glm::dvec3 translation = -(glm::make_mat3(rotation) * glm::make_vec3(position)); // rows read as columns
    std::copy_n(glm::value_ptr(translation), 3, out);
}

std::vector<SourceCamera> parseUpstreamCameras(std::string_view json, const std::string& name, const CameraReading& how)
{
    return upstreamCameras(parseJson(json, name), name, how);
}

Camera cameraOf(const SourceCamera& source)
{
    Camera camera;
    camera.name = source.name;
    std::memcpy(camera.rotation, source.rotation, sizeof(camera.rotation));
    translationFromPosition(source.rotation, source.position, camera.translation);
    camera.fov_x = angleOf(source.width, source.fx);
    camera.fov_y = angleOf(source.height, source.fy);
    setMiddle(camera, source.middle_x / source.width, source.middle_y / source.height);
    camera.appearance = source.appearance;
    const ImageSize size = trainerSize(source.width, source.height, kDefaultResolution);
    camera.width = size.width;
    camera.height = size.height;
    return camera;
}

std::vector<Camera> parseCameraFile(std::string_view json, const std::string& name, TrajectoryFacts* eyes,
                                    const CameraReading& how)
{
    const ParsedJson root = parseJson(json, name);
    std::vector<Camera> cameras;
    TrajectoryFacts stated;
    bool may_be_moved = false;
    if (root.is_array()) {
        for (const SourceCamera& camera : upstreamCameras(root, name, how))
            cameras.push_back(cameraOf(camera));
    } else {
        const JsonObject object(root, name);
        if (object.has("schema")) {
            cameras = trajectoryCameras(object, name, how);
            stated.ipd = object.has("ipd") ? object.positive("ipd") : 0;
            stated.name = object.has("name") ? object.text("name") : "";
            stated.views = trajectoryViews(object, name, how);
        } else if (const ParsedJson* frames = object.find("frames"); frames && frames->is_array()) {
            cameras = transformsCameras(object, name, how);
            may_be_moved = true;
        } else if (const ParsedJson* path = object.find("camera_path"); path && path->is_array())
            cameras = nerfstudioCameras(object, name, how);
        else
            throw Error(
                ErrorCode::InvalidFile,
                formatString("%s: no camera file, expected upstream's cameras.json (an array), a transforms.json "
                             "(\"frames\"), nerfstudio's camera_path.json or a trajectory (\"schema\": "
                             "\"gsc.trajectory/1\"); pass one of these",
                             name.c_str()));
    }
    if (cameras.empty())
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: holds no camera, expected at least one; pass another file", name.c_str()));
    if (eyes)
        *eyes = std::move(stated);
    else if (!stated.views.empty())
        refuseViews(name);
    if (!may_be_moved)
        warnOfNothingToUndo(name, how);
    return cameras;
}

std::vector<Camera> readCameraFile(const std::string& path, TrajectoryFacts* eyes, const CameraReading& how)
{
    if (eyes)
        *eyes = {};
    if (isCameraFolder(path))
        return readCameraFolder(path, eyes, how);
    if (isColmapModel(path)) {
        warnOfNothingToUndo(path, how);
        return readColmapCameras(path, how);
    }
    refuseFolderWithout(path);
    const std::string text = readInputText(path, kMaxFileBytes, "a camera file, or \"stored\" for those in the model");
    const size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf"); // and a byte order mark
    if (first == std::string::npos || (text[first] != '[' && text[first] != '{'))
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: is %s and no JSON, expected a camera file that starts with [ or {; pass a "
                                 "cameras.json, a transforms.json or a trajectory",
                                 path.c_str(), text.compare(0, 4, "\x89GSC") == 0 ? "a model" : "something else"));
    if (text[first] == '[') // a trainer leaves its settings beside its cameras
        warnOfSettingsBeside(path, how);
    return parseCameraFile(text, path, eyes, how);
}

} // namespace gsc
