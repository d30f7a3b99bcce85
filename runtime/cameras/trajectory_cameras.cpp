// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/trajectory_cameras.h"

#include "runtime/cameras/camera_fields.h"

#include <cmath>
#include <numbers>

namespace gsc {

namespace {

constexpr auto kFrameKeys = joinKeys(kProjectionKeys, kCoefficients,
                                     {"name", "width", "height", "fov_x", "fov_y", "fx", "fy", "rotation", "position",
                                      "translation", "appearance", "time", "cx", "cy"});
constexpr auto kTrajectoryKeys =
    joinKeys(kProjectionKeys, kCoefficients,
             {"schema", "name", "description", "metre", "fps", "ipd", "views", "frames", "cx", "cy"});

// Throws if a frame states a lens whose middle lies off the axis: trajectories state that with "views" instead.
void refuseMiddleOffset(const LensKeys& lens)
{
    for (const char* key : {"cx", "cy"})
        if (const JsonObject* holder = lens.holder(key))
            holder->fail(key, shownJson(holder->at(key)),
                         "none in a trajectory, whose frames look through the middle of the image",
                         "state lenses that do not with \"views\"");
}

void readFrameLens(const JsonObject& frame, Camera& camera)
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

// Frames per second by the times of all frames in seconds; 0 if they do not pass.
double rateOf(const std::vector<double>& times)
{
    return times.size() > 1 && times.back() > times.front() ? double(times.size() - 1) / (times.back() - times.front())
                                                            : 0;
}

// `fps`: receives the rate that the times of the frames have, 0 if not every frame states one
std::vector<Camera> readFrames(const JsonObject& root, double& fps, const CameraReading& how)
{
    const std::string schema = root.text("schema");
    if (schema != "gsc.trajectory/1")
        root.fail("schema", "\"" + schema.substr(0, 40) + "\"", "\"gsc.trajectory/1\"", "a newer player may read it");
    const ParsedJson& frames = root.at("frames");
    if (!frames.is_array())
        root.fail("frames", "no array", "an array of frames");
    std::vector<double> times;
    const auto read = [&root, &times](const JsonObject& frame, CameraFindings& found, size_t i) {
        Camera camera;
        camera.name = frame.has("name") ? frame.text("name") : formatString("%04zu", i);
        readRotation(frame, camera.rotation);
        if (frame.has("position") == frame.has("translation"))
            throw Error(ErrorCode::InvalidFile, frame.where(),
                        formatString("%s of \"position\" and \"translation\" is there",
                                     frame.has("position") ? "each" : "none"),
                        "exactly one", "leave one of them in");
        if (frame.has("translation")) {
            frame.vector3("translation", camera.translation);
        } else {
            double position[3];
            frame.vector3("position", position);
            translationFromPosition(camera.rotation, position, camera.translation);
        }
        readFrameLens(frame, camera);
        found.distortion.add({frame, &root, &found.notes});
        refuseMiddleOffset({frame, &root});
        if (frame.has("appearance"))
            camera.appearance = int(frame.integer("appearance", 0, INT32_MAX));
        if (frame.has("time"))
            times.push_back(frame.number("time"));
        return camera;
    };
    std::vector<Camera> cameras =
        readEach({frames, root.where(), "frame", kFrameKeys, &root, kTrajectoryKeys}, how, read);
    fps = times.size() == cameras.size() ? rateOf(times) : 0;
    return cameras;
}

// Reads an angle between the eye's forward axis and one side of the view; it may be negative.
double readSide(const JsonObject& fov, const char* key)
{
    const double angle = fov.number(key);
    if (!(std::abs(angle) < 0.5 * std::numbers::pi - 1e-6))
        fov.fail(key, formatString("%g", angle), "a signed angle in radians within a right angle, as in XrFovf");
    return angle;
}

constexpr const char* kViewKeys[] = {"fov", "pose"};
constexpr const char* kSideKeys[] = {"left", "right", "up", "down"};
constexpr const char* kPoseKeys[] = {"position", "rotation"};

std::vector<EyeView> readViews(const JsonObject& root, const CameraReading& how)
{
    std::vector<EyeView> views;
    if (!root.has("views"))
        return views;
    const ParsedJson& array = root.at("views");
    if (!array.is_array() || array.empty() || array.size() > 2)
        root.fail("views", "no array of one or two", "one eye, or the left and the right one");
    if (root.has("ipd"))
        root.fail("ipd", "given together with \"views\"", "one of them; the views say where the eyes are");
    CameraNotes notes(root.where());
    for (size_t i = 0; i < array.size(); ++i) {
        const JsonObject eye(array[i], formatString("%s: view %zu", root.where().c_str(), i));
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

} // namespace

std::vector<Camera> trajectoryCameras(const JsonObject& root, TrajectoryFacts& facts, const CameraReading& how)
{
    std::vector<Camera> cameras = readFrames(root, facts.fps, how);
    if (root.has("fps"))
        facts.fps = root.positive("fps");
    facts.ipd = root.has("ipd") ? root.positive("ipd") : 0;
    facts.name = root.has("name") ? root.text("name") : "";
    facts.views = readViews(root, how);
    return cameras;
}
} // namespace gsc
