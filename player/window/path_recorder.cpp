// SPDX-License-Identifier: Apache-2.0
// The frames in the file state "translation", which the camera reader passes on unchanged. "position" would be rounded
// for cameras whose own file states a translation.
#include "player/window/path_recorder.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "runtime/cameras/json_fields.h"
#include "runtime/cli/json.h"
#include "player/poses/pose.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace gsc {

namespace {

constexpr double kMostRate = 1000;
constexpr double kSameTime = 1e-6;   // two times count as equal if they differ by less than this share of a frame
constexpr double kMostLength = 1e15; // largest coordinate that a camera file may state
constexpr size_t kPieceBytes = size_t(1) << 20;

bool isAngleOfFile(double angle)
{
    return angle >= 1e-6 && angle < std::numbers::pi - 1e-6;
}

bool isSideOfFile(uint32_t side)
{
    return side >= 1 && side <= kMaxImageSide;
}

// Returns `camera` in the form that a trajectory's frame can state; none if there is no such form.
std::optional<Camera> frameOf(const Camera& camera)
{
    Camera frame = camera;
    if (!hasRotation(camera)) { // the camera's axes are scaled, or are no rotation at all
        const std::optional<CameraPose> pose = poseOf(camera);
        if (!pose)
            return std::nullopt;
        setPose(*pose, frame);
    }
    const bool fits = std::all_of(frame.translation, frame.translation + 3,
                                  [](double v) { return std::abs(v) <= kMostLength; }) && // also false for NaN
                      isAngleOfFile(frame.fov_x) &&
                      isAngleOfFile(frame.fov_y) && isSideOfFile(frame.width) && isSideOfFile(frame.height);
    frame.name.clear();
    return fits ? std::optional(frame) : std::nullopt;
}

Camera frameBetween(const Camera& from, const Camera& to, double share)
{
    Camera frame = from;
    const std::optional<CameraPose> first = poseOf(from), second = poseOf(to);
    if (first && second)
        setPose(between(*first, *second, share), frame);
    // if the size changes, angles in between would change the shape of pixels
    if (from.width == to.width && from.height == to.height) {
        frame.fov_x += (to.fov_x - from.fov_x) * share;
        frame.fov_y += (to.fov_y - from.fov_y) * share;
    }
    return frame;
}

std::string frameText(const Camera& camera, double seconds)
{
    OrderedJson frame;
    frame["width"] = camera.width;
    frame["height"] = camera.height;
    frame["fov_x"] = camera.fov_x;
    frame["fov_y"] = camera.fov_y;
    frame["translation"] = camera.translation;
    for (size_t row = 0; row < 3; ++row)
        frame["rotation"].push_back(
            {camera.rotation[3 * row], camera.rotation[3 * row + 1], camera.rotation[3 * row + 2]});
    if (camera.appearance >= 0)
        frame["appearance"] = camera.appearance;
    frame["time"] = seconds;
    return jsonText(frame, -1);
}

} // namespace

void PathRecorder::start(const std::string& name, double fps, double metre)
{
    if (!(fps > 0 && fps <= kMostRate))
        throw Error(ErrorCode::Usage, formatString("%.60s", name.c_str()),
                    formatString("a path of %g frames per second", fps),
                    formatString("more than 0 and at most %g", kMostRate), "pass such a rate");
    *this = {};
    m_name = name;
    m_fps = fps;
    m_metre = metre > 0 && metre < kMostLength ? metre : 0;
}

bool PathRecorder::add(double seconds, const Camera& camera, double ipd)
{
    assert(records());
    if (camera.tan_mid_x != 0 || camera.tan_mid_y != 0)
        throw Error(ErrorCode::Unsupported, formatString("camera %.60s", camera.name.c_str()),
                    formatString("the middle of its image lies off its axis by %g right and %g down at depth 1",
                                 camera.tan_mid_x, camera.tan_mid_y),
                    "0, which is all that a trajectory's frames have", "record with a centred lens");
    const std::optional<Camera> frame = frameOf(camera);
    if (!frame || !std::isfinite(seconds) || (m_has_last && !(seconds > m_last.seconds)))
        return false;
    if (!m_has_last)
        m_begin = seconds;
    while (m_frames.size() < kMostFrames) {
        const double wanted = m_begin + double(m_frames.size()) / m_fps;
        const double ahead = (wanted - seconds) * m_fps; // time of the next frame minus time of the sample, in frames
        if (ahead > kSameTime)
            break;
        if (ahead >= -kSameTime)
            m_frames.push_back(*frame);
        else
            m_frames.push_back(
                frameBetween(m_last.camera, *frame, (wanted - m_last.seconds) / (seconds - m_last.seconds)));
    }
    m_last = {seconds, *frame};
    m_has_last = true;
    if (m_ipd == 0 && ipd > 0 && ipd < kMostLength)
        m_ipd = ipd;
    return true;
}

size_t PathRecorder::stop(const std::string& path, bool overwrite)
{
    if (m_frames.empty())
        throw Error(ErrorCode::Usage, path, "nothing was recorded", "at least one frame",
                    "start a recording and let the window draw");
    OutputFile file(path, OutputKind::Binary, overwrite);
    std::string text = "{\n  \"schema\": \"gsc.trajectory/1\",\n  \"name\": " + jsonText(m_name, -1);
    const auto state = [&](const char* key, double value) {
        if (value > 0)
            text += formatString(",\n  \"%s\": ", key) + jsonText(value, -1);
    };
    state("fps", m_fps);
    state("metre", m_metre);
    state("ipd", m_ipd);
    text += ",\n  \"frames\": [";
    for (size_t i = 0; i < m_frames.size(); ++i) {
        text += (i > 0 ? ",\n    " : "\n    ") + frameText(m_frames[i], double(i) / m_fps);
        if (text.size() > kPieceBytes) {
            file.write(text);
            text.clear();
        }
    }
    file.write(text + "\n  ]\n}\n");
    file.sync();
    file.commit();
    const size_t frames = m_frames.size();
    *this = {};
    return frames;
}

} // namespace gsc
