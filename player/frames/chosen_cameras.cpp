// SPDX-License-Identifier: Apache-2.0
#include "player/frames/chosen_cameras.h"

#include "format/numbers/count_text.h"
#include <gsc/error.h>
#include "player/frames/made_cameras.h"
#include "player/poses/extent.h"
#include "player/poses/pose.h"
#include "runtime/cameras/scene_cameras.h"
#include "runtime/cameras/world_up.h"
#include "runtime/cli/suggestion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

namespace gsc {

namespace {

constexpr double kTurnSeconds = 10;                  // length of a turntable
constexpr double kLeastWay = 2, kMostWay = 30;       // seconds of a way; in between one from camera to camera
constexpr double kLeastFps = 0.001, kMostFps = 1000; // frames per second of a trajectory that videos take

// Throws if the range of frames that was asked for ends behind the last camera.
void checkRange(const CameraChoice& choice, size_t cameras)
{
    if (choice.first >= cameras)
        throw Error(ErrorCode::Usage, choice.range.empty() ? "--frames" : choice.range,
                    formatString("camera %llu is not there", static_cast<unsigned long long>(choice.first)),
                    formatString("at most %zu", cameras - 1), "pass one of those");
    const bool open_end = choice.end == std::numeric_limits<uint64_t>::max();
    if (choice.may_end_sooner || open_end || choice.end <= cameras)
        return;
    const std::string name = choice.range.substr(0, choice.range.find(' '));
    const auto first = static_cast<unsigned long long>(choice.first);
    throw Error(ErrorCode::Usage, choice.range, "ends behind the last camera", formatString("at most %zu", cameras),
                formatString("pass %s %llu:%zu or %llu:", name.c_str(), first, cameras, first));
}

// Returns the numbers of the cameras called `name`.
std::vector<uint64_t> numbersOf(const std::string& name, const std::vector<Camera>& cameras, const std::string& model)
{
    std::vector<uint64_t> numbers;
    std::vector<std::string> names;
    for (const Camera& camera : cameras) {
        if (camera.name == name)
            numbers.push_back(names.size());
        names.push_back(camera.name);
    }
    if (numbers.empty())
        throw Error(ErrorCode::Usage, "--cameras stored:" + name,
                    formatString("none of the %s stored in %s has that name",
                                 formatCount(cameras.size(), "camera").c_str(), model.c_str()),
                    "one such as " + listWords(nearestWords(name, names, 3)), "pass one of those");
    return numbers;
}

// Returns the numbers of the cameras that were chosen, by name and by range.
std::vector<uint64_t> pickCameras(const std::vector<Camera>& cameras, const std::string& model,
                                  const CameraChoice& choice)
{
    std::vector<uint64_t> picked;
    for (const std::string& name : choice.names)
        std::ranges::copy(numbersOf(name, cameras, model), std::back_inserter(picked));
    if (choice.names.empty()) {
        picked.resize(cameras.size());
        std::iota(picked.begin(), picked.end(), 0);
    }
    if (picked.empty())
        return picked;
    checkRange(choice, picked.size());
    const auto end = ptrdiff_t(std::min<uint64_t>(choice.end, picked.size()));
    return {picked.begin() + ptrdiff_t(choice.first), picked.begin() + end};
}

// Lens of a camera that is made; `taken` may be empty, or state no angle.
Camera firstLens(const std::vector<Camera>& taken)
{
    constexpr double kAngle = 60 * std::numbers::pi / 180;
    Camera lens;
    if (taken.empty()) {
        lens.width = 1280;
        lens.height = 720;
    } else {
        lens = taken.front();
    }
    if (!(lens.fov_x > 0 || lens.fov_y > 0 || lens.focal_x > 0))
        lens.fov_x = kAngle;
    return lens;
}

// Throws if no way leads through the cameras.
void checkKeys(const std::vector<Camera>& keys, const TrajectoryFacts& facts, const std::string& source)
{
    if (keys.size() < 2)
        throw Error(ErrorCode::Usage, "--interpolate", "one camera of " + source + " is chosen", "two or more",
                    "choose more with --cameras and --frames");
    if (!facts.views.empty())
        throw Error(ErrorCode::Usage, "--interpolate", source + " gives the eyes lenses of their own with \"views\"",
                    "cameras that have one", "choose other --cameras, or play it with --video");
    for (const Camera& key : keys)
        if (!poseOf(key))
            throw Error(ErrorCode::Usage, "camera " + key.name, "has no place or no axes", "a pose for --interpolate",
                        "leave it out with --cameras or --frames");
}

size_t framesOf(double seconds, double fps)
{
    return size_t(std::max(2LL, std::llround(seconds * fps)));
}

// Cameras on a way through the keys, all of the first one's size, as a video has to have.
std::vector<Camera> wayOf(std::vector<Camera> keys, const CameraChoice& choice, const ViewChoice& view, double fps)
{
    finishCamera(keys.front(), view.width, view.height, view.fov_x);
    const uint32_t width = keys.front().width, height = keys.front().height;
    for (Camera& key : keys)
        finishCamera(key, width, height, view.fov_x);
    const double usual = std::clamp(double(keys.size() - 1), kLeastWay, kMostWay);
    return wayThrough(keys, framesOf(choice.seconds > 0 ? choice.seconds : usual, fps));
}

Sight modelSight(const Scene& scene, const std::vector<Camera>& cameras, const std::array<double, 3>& up)
{
    std::array<double, 3> low{}, high{};
    for (int i = 0; i < 3; ++i) {
        glm::dvec3 axis(0);
        axis[i] = 1;
        std::tie(low[size_t(i)], high[size_t(i)]) = extentAlong(scene.view(), axis);
    }
    return turntableSight(cameras, up, low, high);
}

// Warns if a good part of the turn shows what no camera saw.
void tellUnseen(const std::vector<Camera>& all, const Sight& sight, const std::array<double, 3>& up,
                const std::string& source, Reporter& log)
{
    constexpr double kMuch = 120; // degrees
    const double gap = widestGap(all, sight, up) * 180 / std::numbers::pi;
    if (gap > kMuch)
        log.warning(
            formatString("%s: no camera stands over %.0f degrees of the turn, so the video shows there what none "
                         "has seen; --interpolate stays with the cameras",
                         source.c_str(), gap));
}

std::string viewName(const Sight& sight)
{
    const std::array<double, 3>&p = sight.position, &t = sight.target;
    return formatString("view from %g,%g,%g to %g,%g,%g", p[0], p[1], p[2], t[0], t[1], t[2]);
}

// Replaces the chosen cameras by those that are to be made of them. `all`: all cameras of the source, a file.
void makeCameras(const Scene& scene, const CameraChoice& choice, const ViewChoice& view, const std::vector<Camera>& all,
                 const std::string& source, ChosenCameras& chosen, Reporter& log)
{
    std::vector<Camera>& cameras = chosen.cameras;
    const double fps = choice.fps > 0 ? choice.fps : chosen.facts.fps;
    if (choice.motion == CameraMotion::Interpolate) {
        checkKeys(cameras, chosen.facts, source);
        if (!chosen.facts.is_path && choice.names.empty())
            sortByName(cameras);
        cameras = wayOf(std::move(cameras), choice, view, fps);
    } else {
        const std::array<double, 3>& up = chosen.up;
        const Sight sight = choice.position ? Sight{*choice.position, *choice.look_at} : modelSight(scene, cameras, up);
        const Camera lens = firstLens(cameras);
        chosen.facts.views.clear();
        if (choice.motion == CameraMotion::Turntable) {
            tellUnseen(all, sight, up, source, log);
            cameras = turntable(sight, up, lens, framesOf(choice.seconds > 0 ? choice.seconds : kTurnSeconds, fps));
        } else {
            cameras = {cameraAt(sight, up, lens)};
            cameras.front().name = "view";
            chosen.facts.name = viewName(sight);
        }
    }
    chosen.facts.is_path = true;
    chosen.numbers.resize(cameras.size());
    std::iota(chosen.numbers.begin(), chosen.numbers.end(), 0);
}

} // namespace

ChosenCameras chooseCameras(const Scene& scene, const std::string& model, const CameraChoice& choice,
                            const ViewChoice& view, Reporter& log)
{
    ChosenCameras chosen;
    std::vector<std::string> warnings;
    const std::vector<Camera> all =
        sceneCameras(scene, choice.file, {choice.ignore_distortion, choice.transform, &warnings}, &chosen.facts);
    const bool needs_none = choice.position || choice.motion == CameraMotion::Turntable;
    if (all.empty() && !(needs_none && choice.names.empty()))
        throw Error(ErrorCode::Usage, model, "holds no cameras", "some to play",
                    "pass --cameras FILE, or --position to gsc-play or bench");
    for (const std::string& text : warnings)
        log.warning(text);
    if (!(chosen.facts.fps >= kLeastFps && chosen.facts.fps <= kMostFps))
        chosen.facts.fps = kDefaultFps;
    chosen.up = worldUp(all);
    chosen.numbers = pickCameras(all, model, choice);
    for (const uint64_t number : chosen.numbers)
        chosen.cameras.push_back(all[number]);
    if (choice.makesCameras())
        makeCameras(scene, choice, view, all, choice.isFile() ? choice.file : model, chosen, log);
    return chosen;
}

} // namespace gsc
