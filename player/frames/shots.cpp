// SPDX-License-Identifier: Apache-2.0
#include "player/frames/shots.h"

#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/json_fields.h"
#include "player/frames/lod_target.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

std::vector<Camera> storedCameras(const Scene& scene, const std::string& file)
{
    std::vector<Camera> cameras;
    for (const SourceCamera& stored : scene.cameras())
        cameras.push_back(cameraOf(stored));
    if (cameras.empty())
        throw Error(ErrorCode::Usage,
                    formatString("%s: holds no cameras, expected some to play; pass --cameras FILE", file.c_str()));
    return cameras;
}

// A head of a trajectory with views, sized as asked for. The lens is the view's whatever the size is.
void sizeHead(Camera& head, const PlayOptions& options)
{
    if (options.width > 0) {
        head.width = options.width;
        head.height = options.height;
    }
    if (head.width == 0)
        throw Error(
            ErrorCode::Usage,
            formatString("camera %s: its file states no image size, expected one; pass --size WxH", head.name.c_str()));
}

// Throws what the views of a trajectory cannot give or take.
void checkViews(const TrajectoryFacts& facts, const PlayOptions& options)
{
    const char* const file = options.cameras.c_str();
    if (options.ipd.value > 0)
        throw Error(ErrorCode::Usage, formatString("--ipd: %s says with \"views\" where the eyes are, expected no "
                                                   "distance; leave --ipd out",
                                                   file));
    if (options.fov_x > 0)
        throw Error(ErrorCode::Usage, formatString("--fov: %s gives the eyes their lenses with \"views\", expected no "
                                                   "angle; leave --fov out",
                                                   file));
    if (options.eyes == 2 && facts.views.size() < 2)
        throw Error(ErrorCode::Usage, formatString("%s: \"views\" holds one eye, expected the left and the right one "
                                                   "for two; pass --eyes 1",
                                                   file));
}

// Distance of two eyes in world units; 0 with one eye, or where views say where they are. Throws Error(Usage) where it
// is not known.
double eyeDistance(const Scene& scene, const TrajectoryFacts& facts, const PlayOptions& options, Reporter& log)
{
    const Length& given = options.ipd;
    if (options.eyes == 1 && given.value > 0)
        throw Error(ErrorCode::Usage, "--ipd: has no effect with one eye, expected two; pass --eyes 2 or leave it out");
    if (options.eyes == 1 || !facts.views.empty())
        return 0;
    if (given.value > 0 && given.unit == LengthUnit::World)
        return given.value;
    if (given.value == 0 && facts.ipd > 0)
        return facts.ipd;
    const char* const model = options.input.c_str();
    const std::optional<Metre> metre = metreOfManifest(scene.manifest());
    if (!metre && given.value > 0)
        throw Error(ErrorCode::Usage,
                    formatString("--ipd %gm: %s does not say how long a metre is, expected a length in world units; "
                                 "pass a plain number, or convert the model again",
                                 given.value, model));
    if (!metre)
        throw Error(ErrorCode::Usage,
                    formatString("%s: states no distance of the eyes, expected \"ipd\" in a trajectory or a metre in "
                                 "%s; pass --ipd LENGTH, or convert the model again",
                                 options.cameras == "stored" ? model : options.cameras.c_str(), model));
    const double metres = given.value > 0 ? given.value : kEyesApart;
    if (!(metres * metre->units < 1e15))
        throw Error(ErrorCode::Usage, formatString("--ipd %gm: %g world units in %s, expected less than 1e15; pass a "
                                                   "shorter one",
                                                   metres, metres * metre->units, model));
    if (given.value == 0)
        log.tell(formatString("eyes %g m apart: %.4g world units, because the model's metre is %.4g; --ipd LENGTH sets "
                              "another distance",
                              metres, metres * metre->units, metre->units));
    return metres * metre->units;
}

// Throws where the range that was asked for ends behind the cameras.
void checkRange(const PlayOptions& options, size_t cameras)
{
    if (options.frame_first >= cameras)
        throw Error(ErrorCode::Usage,
                    formatString("%s: camera %llu is not there, expected at most %zu; pass one of those",
                                 options.frame_range.empty() ? "--frames" : options.frame_range.c_str(),
                                 static_cast<unsigned long long>(options.frame_first), cameras - 1));
    const bool open_end = options.frame_end == std::numeric_limits<uint64_t>::max();
    if (options.frames_may_end_sooner || open_end || options.frame_end <= cameras)
        return;
    const std::string name = options.frame_range.substr(0, options.frame_range.find(' '));
    const auto first = static_cast<unsigned long long>(options.frame_first);
    throw Error(ErrorCode::Usage,
                formatString("%s: ends behind the last camera, expected at most %zu; pass %s "
                             "%llu:%zu or %llu:",
                             options.frame_range.c_str(), cameras, name.c_str(), first, cameras, first));
}

// --fov is one angle, from which the other follows as of square pixels.
void tellSquared(const std::vector<Camera>& cameras, const PlayOptions& options, Reporter& log)
{
    constexpr double kSquare = 0.01; // relative; the trainers' own focal lengths differ by less
    if (!(options.fov_x > 0))
        return;
    const auto squared = std::ranges::count_if(cameras, [](const Camera& camera) {
        if (!(camera.fov_x > 0 && camera.fov_y > 0 && camera.width > 0 && camera.height > 0))
            return camera.focal_x > 0 && std::abs(camera.focal_y / camera.focal_x - 1) > kSquare;
        const double shape = std::tan(camera.fov_y / 2) * camera.width / (std::tan(camera.fov_x / 2) * camera.height);
        return std::abs(shape - 1) > kSquare;
    });
    if (squared > 0)
        log.warning(formatString("--fov: pixels of %lld of %zu cameras are not square in %s; with an angle of your own "
                                 "they are drawn square",
                                 static_cast<long long>(squared), cameras.size(), options.cameras.c_str()));
}

std::vector<Shot> cutShots(std::vector<Camera> cameras, const TrajectoryFacts& facts, double ipd,
                           const PlayOptions& options)
{
    checkRange(options, cameras.size());
    std::vector<Shot> shots;
    const uint64_t end = std::min<uint64_t>(options.frame_end, cameras.size());
    for (uint64_t i = options.frame_first; i < end; ++i) {
        Camera& camera = cameras[i];
        if (facts.views.empty())
            finishCamera(camera, options.width, options.height, options.fov_x);
        else
            sizeHead(camera, options);
        if (camera.width < 1 || camera.height < 1 || camera.width > kMaxImageSide || camera.height > kMaxImageSide)
            throw Error(ErrorCode::Usage,
                        formatString("camera %s: its image is %u x %u pixels, expected 1 to %u each; pass --size WxH",
                                     camera.name.c_str(), camera.width, camera.height, kMaxImageSide));
        Shot shot{camera, i, -1, ipd, std::nullopt};
        if (!facts.views.empty())
            shot.camera = eyeOfHead(camera, facts.views[0]);
        if (options.eyes == 2 && facts.views.size() == 2)
            shot.right_eye = eyeOfHead(camera, facts.views[1]);
        shots.push_back(std::move(shot));
    }
    return shots;
}

void chooseAppearance(const Scene& scene, const PlayOptions& options, std::vector<Shot>& shots, Reporter& log)
{
    if (options.appearance >= 0) {
        (void)scene.appearanceRow(options.appearance); // throws where the model has no such row
        for (Shot& shot : shots)
            shot.appearance = options.appearance;
        return;
    }
    const std::vector<uint32_t> known = scene.appearanceRows();
    if (known.empty())
        return;
    const int fallback = int(known.front());
    uint64_t without = 0, missing = 0;
    for (Shot& shot : shots) {
        const int wanted = shot.camera.appearance;
        const bool there = wanted >= 0 && std::binary_search(known.begin(), known.end(), uint32_t(wanted));
        without += wanted < 0;
        missing += wanted >= 0 && !there;
        shot.appearance = there ? wanted : fallback;
    }
    if (without > 0)
        log.warning(formatString("%s: the model has an appearance embedding and %llu of %zu cameras name no row of it; "
                                 "row %d is used, pass --appearance ROW to choose",
                                 options.input.c_str(), static_cast<unsigned long long>(without), shots.size(),
                                 fallback));
    if (missing > 0)
        log.warning(formatString("%s: %llu of %zu cameras name an appearance row that is not in the file; row %d is "
                                 "used, pass --appearance ROW to choose",
                                 options.input.c_str(), static_cast<unsigned long long>(missing), shots.size(),
                                 fallback));
}

} // namespace

std::vector<Shot> chooseShots(const Scene& scene, const PlayOptions& options, Reporter& log, std::string* title)
{
    checkLevelOptions(scene, options);
    TrajectoryFacts eyes;
    std::vector<std::string> warnings;
    std::vector<Camera> cameras =
        options.cameras == "stored"
            ? storedCameras(scene, options.input)
            : readCameraFile(options.cameras, &eyes, {options.ignore_distortion, options.cameras_transform, &warnings});
    for (const std::string& text : warnings)
        log.warning(text);
    if (!eyes.views.empty())
        checkViews(eyes, options);
    tellSquared(cameras, options, log);
    if (title != nullptr)
        *title = eyes.name;
    const double ipd = eyeDistance(scene, eyes, options, log);
    std::vector<Shot> shots = cutShots(std::move(cameras), eyes, ipd, options);
    for (Shot& shot : shots)
        std::copy_n(scene.view().origin, 3, shot.origin);
    chooseAppearance(scene, options, shots, log);
    return shots;
}

FrameOptions frameOptions(const Scene& scene, const PlayOptions& options)
{
    FrameOptions frame;
    frame.tier = options.tier;
    frame.stereo = options.stereo;
    frame.near_z = float(options.near_z);
    frame.lod_bias = float(options.lod_bias);
    frame.lod_fade = float(options.lod_fade);
    frame.lod_hysteresis = float(options.lod_hysteresis);
    frame.reuse = options.reuse;
    frame.foveation.smallest = float(options.foveaPixels());
    const bool white = (scene.view().params->flags & kModelWhiteBackground) != 0;
    for (size_t c = 0; c < 3; ++c)
        frame.background[c] = options.background ? (*options.background)[c] : white ? 1.0f : 0.0f;
    return frame;
}

FrameOptions exactOptions(FrameOptions frame)
{
    frame.tier = Tier::Exact;
    frame.stereo = StereoMode::Exact;
    frame.lod_bias = frame.lod_fade = frame.lod_hysteresis = 0;
    frame.reuse = {};
    frame.foveation = {};
    return frame;
}

void shotEyes(const Shot& shot, uint32_t eye_count, EyeParams* eyes)
{
    if (eye_count == 1) {
        eyes[0] = eyeParams(shot.camera, shot.origin);
        return;
    }
    if (shot.right_eye) {
        eyes[0] = eyeParams(shot.camera, shot.origin);
        eyes[1] = eyeParams(*shot.right_eye, shot.origin);
        return;
    }
    Camera left, right;
    stereoPair(shot.camera, shot.ipd, left, right);
    eyes[0] = eyeParams(left, shot.origin);
    eyes[1] = eyeParams(right, shot.origin);
}

int32_t shotAppearance(const Scene& scene, const Shot& shot)
{
    return shot.appearance < 0 ? -1 : scene.appearanceRow(shot.appearance);
}

} // namespace gsc
