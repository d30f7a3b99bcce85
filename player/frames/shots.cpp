// SPDX-License-Identifier: Apache-2.0
#include "player/frames/shots.h"

#include "format/numbers/count_text.h"
#include <gsc/error.h>
#include "player/frames/chosen_cameras.h"
#include "runtime/cameras/json_fields.h"
#include "runtime/cameras/scene_cameras.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// Gives a camera of a trajectory the size of picture that was asked for. Applies to trajectories that state a view for
// each eye; the angles of view stay.
void sizeHead(Camera& head, const ViewChoice& view)
{
    const double own_height = head.width > 0 ? double(head.height) * view.width / head.width : 0;
    if (view.width > 0) {
        head.width = view.width;
        head.height = view.height > 0 ? view.height : uint32_t(std::lround(own_height));
    }
    if (head.width == 0 || head.height == 0)
        throw Error(ErrorCode::Usage, "camera " + head.name, "its file states no image size", "one", "pass --size WxH");
}

// Throws if options contradict a trajectory that states a view for each eye.
void checkViews(const TrajectoryFacts& facts, const std::string& cameras, const ViewChoice& view)
{
    const char* const file = cameras.c_str();
    if (view.ipd.value > 0)
        throw Error(ErrorCode::Usage, "--ipd", formatString("%s says with \"views\" where the eyes are", file),
                    "no distance", "leave --ipd out");
    if (view.fov_x > 0)
        throw Error(ErrorCode::Usage, "--fov", formatString("%s gives the eyes their lenses with \"views\"", file),
                    "no angle", "leave --fov out");
    if (view.eyes == 2 && facts.views.size() < 2)
        throw Error(ErrorCode::Usage, file, "\"views\" holds one eye", "the left and the right one for two",
                    "pass --eyes 1");
}

// Distance of two eyes in world units; 0 with one eye, or if the trajectory states a view for each eye. Throws
// Error(Usage) if no distance is known.
double eyeDistance(const Scene& scene, const std::string& file, const TrajectoryFacts& facts,
                   const CameraChoice& choice, const ViewChoice& view, Reporter& log)
{
    const Length& given = view.ipd;
    if (view.eyes == 1 && given.value > 0)
        throw Error(ErrorCode::Usage, "--ipd", "has no effect with one eye", "two", "pass --eyes 2 or leave it out");
    if (view.eyes == 1 || !facts.views.empty())
        return 0;
    if (given.value > 0 && given.unit == LengthUnit::World)
        return given.value;
    if (given.value == 0 && facts.ipd > 0)
        return facts.ipd;
    const char* const model = file.c_str();
    const std::optional<Metre> metre = metreOfManifest(scene.manifest());
    if (!metre && given.value > 0)
        throw Error(ErrorCode::Usage, formatString("--ipd %gm", given.value),
                    formatString("%s does not say how long a metre is", model), "a length in world units",
                    "pass a plain number, or convert the model again");
    if (!metre)
        throw Error(ErrorCode::Usage, choice.isFile() ? choice.file.c_str() : model, "states no distance of the eyes",
                    formatString("\"ipd\" in a trajectory or a metre in %s", model),
                    "pass --ipd LENGTH, or convert the model again");
    const double metres = given.value > 0 ? given.value : kEyesApart;
    if (!(metres * metre->units < 1e15))
        throw Error(ErrorCode::Usage, formatString("--ipd %gm", metres),
                    formatString("%g world units in %s", metres * metre->units, model), "less than 1e15",
                    "pass a shorter one");
    if (given.value == 0)
        log.tell(formatString("eyes %g m apart: %.4g world units, because the model's metre is %.4g; --ipd LENGTH sets "
                              "another distance",
                              metres, metres * metre->units, metre->units));
    return metres * metre->units;
}

// Warns if cameras have pixels that are not square: --fov is one angle, and the other follows as for square pixels.
void tellSquared(const std::vector<Camera>& cameras, const std::string& file, const ViewChoice& view, Reporter& log)
{
    // relative tolerance; focal_x and focal_y of the trainers' own cameras differ by less
    constexpr double kSquare = 0.01;
    if (!(view.fov_x > 0))
        return;
    const auto squared = std::ranges::count_if(cameras, [](const Camera& camera) {
        if (!(camera.fov_x > 0 && camera.fov_y > 0 && camera.width > 0 && camera.height > 0))
            return camera.focal_x > 0 && std::abs(camera.focal_y / camera.focal_x - 1) > kSquare;
        const double shape = std::tan(camera.fov_y / 2) * camera.width / (std::tan(camera.fov_x / 2) * camera.height);
        return std::abs(shape - 1) > kSquare;
    });
    if (squared > 0)
        log.warning(formatString("--fov: pixels of %s of %s are not square in %s; with an angle of your own "
                                 "they are drawn square",
                                 formatCount(uint64_t(squared)).c_str(), formatCount(cameras.size(), "camera").c_str(),
                                 file.c_str()));
}

std::vector<Shot> cutShots(ChosenCameras chosen, double ipd, const ViewChoice& view)
{
    const std::vector<EyeView>& views = chosen.facts.views;
    std::vector<Shot> shots;
    for (size_t i = 0; i < chosen.cameras.size(); ++i) {
        Camera& camera = chosen.cameras[i];
        if (views.empty()) {
            const bool keeps_size = view.sizes_others && camera.width > 0;
            finishCamera(camera, keeps_size ? 0 : view.width, keeps_size ? 0 : view.height, view.fov_x);
        } else {
            sizeHead(camera, view);
        }
        if (camera.width < 1 || camera.height < 1 || camera.width > kMaxImageSide || camera.height > kMaxImageSide)
            throw Error(ErrorCode::Usage, "camera " + camera.name,
                        formatString("its image is %u x %u pixels", camera.width, camera.height),
                        formatString("1 to %u each", kMaxImageSide), "pass --size WxH");
        Shot shot{camera, chosen.numbers[i], -1, ipd, std::nullopt};
        if (!views.empty())
            shot.camera = eyeOfHead(camera, views[0]);
        if (view.eyes == 2 && views.size() == 2)
            shot.right_eye = eyeOfHead(camera, views[1]);
        shots.push_back(std::move(shot));
    }
    return shots;
}

void chooseAppearance(const Scene& scene, const std::string& model, int row, std::vector<Shot>& shots, Reporter& log)
{
    if (row >= 0) {
        (void)scene.appearanceRow(row); // throws if the model has no such row
        for (Shot& shot : shots)
            shot.appearance = row;
        return;
    }
    const std::vector<uint32_t> known = scene.appearanceRows();
    if (known.empty())
        return;
    uint64_t without = 0, missing = 0;
    for (Shot& shot : shots) {
        shot.appearance = appearanceOf(known, shot.camera);
        without += shot.camera.appearance < 0;
        missing += shot.camera.appearance >= 0 && shot.appearance != shot.camera.appearance;
    }
    if (without > 0)
        log.warning(formatString("%s: the model has an appearance embedding, but %s of %s without a row of it; "
                                 "row %d is used, pass --appearance ROW to choose",
                                 model.c_str(), formatCount(without).c_str(),
                                 formatCount(shots.size(), "camera").c_str(), int(known.front())));
    if (missing > 0)
        log.warning(formatString("%s: the appearance row of %s of %s is not in the file; row %d is "
                                 "used, pass --appearance ROW to choose",
                                 model.c_str(), formatCount(missing).c_str(),
                                 formatCount(shots.size(), "camera").c_str(), int(known.front())));
}

} // namespace

std::vector<Shot> chooseShots(const Scene& scene, const std::string& model, const CameraChoice& choice,
                              const ViewChoice& view, Reporter& log, ShotFacts* told)
{
    ChosenCameras chosen = chooseCameras(scene, model, choice, view, log);
    const TrajectoryFacts facts = chosen.facts;
    const std::array<double, 3> up = chosen.up;
    if (!facts.views.empty())
        checkViews(facts, choice.file, view);
    tellSquared(chosen.cameras, choice.file, view, log);
    const double ipd = eyeDistance(scene, model, facts, choice, view, log);
    std::vector<Shot> shots = cutShots(std::move(chosen), ipd, view);
    for (Shot& shot : shots) {
        std::copy_n(scene.view().origin, 3, shot.origin);
        shot.up = up;
    }
    chooseAppearance(scene, model, choice.appearance, shots, log);
    if (told != nullptr)
        *told = {facts.name,
                 facts.is_path ? "" : "the cameras of " + (choice.isFile() ? choice.file : model) + " are in no order",
                 choice.fps > 0 ? choice.fps : facts.fps};
    return shots;
}

FrameChoice choiceOn(const std::string& no_path, const FrameChoice& choice, Reporter& log)
{
    FrameChoice drawn = choice;
    drawn.on_path = no_path.empty();
    if (!drawn.on_path && choice.detailPixels() > 0)
        log.warning(
            formatString("detail %g: %s, expected two frames or more of a trajectory, which draw what those before "
                         "them made; drawn as without detail",
                         choice.detailPixels(), no_path.c_str()));
    return drawn;
}

FrameOptions frameOptions(const Scene& scene, const FrameChoice& choice)
{
    FrameOptions frame = modelOptions(scene);
    frame.tier = choice.tier;
    frame.stereo = choice.stereo;
    frame.near_z = float(choice.near_z);
    frame.lod_bias = float(choice.lod_bias);
    frame.lod_fade = float(choice.lod_fade);
    frame.lod_hysteresis = float(choice.lod_hysteresis);
    frame.reuse = choice.reuse;
    frame.foveation.smallest = float(choice.foveaPixels());
    frame.detail = float(choice.detailPixels());
    if (choice.background)
        std::copy_n(choice.background->begin(), 3, frame.background);
    return frame;
}

} // namespace gsc
