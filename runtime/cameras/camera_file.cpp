// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_file.h"

#include "runtime/cameras/camera_source.h"
#include "runtime/cameras/colmap_cameras.h"
#include "runtime/cameras/json_fields.h"
#include "runtime/cameras/trainer_cameras.h"
#include "runtime/cameras/trajectory_cameras.h"
#include "runtime/cameras/transforms_cameras.h"
#include <gsc/file/read_file.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace gsc {

namespace {

constexpr uint64_t kMaxFileBytes = uint64_t(1) << 30;

// End of a warning if CamerasTransform::Undo is asked of a file without a transform.
constexpr const char* kNothingToUndo =
    ": is of a kind that states no \"applied_transform\" to undo; its poses are taken as they stand";

} // namespace

std::vector<Camera> parseCameraFile(std::string_view json, const std::string& name, TrajectoryFacts* eyes,
                                    const CameraReading& how)
{
    const ParsedJson root = parseJson(json, name);
    std::vector<Camera> cameras;
    TrajectoryFacts stated;
    bool may_be_moved = false;
    if (!root.is_array()) {
        const JsonObject object(root, name);
        stated.is_path = object.has("schema") || object.has("camera_path");
        const auto holds = [&](const char* key) { return object.has(key) && object.at(key).is_array(); };
        if (object.has("schema")) {
            cameras = trajectoryCameras(object, stated, how);
        } else if ((may_be_moved = holds("frames"))) {
            cameras = transformsCameras(object, how);
        } else if (holds("camera_path")) {
            cameras = nerfstudioCameras(object, how);
            if (object.has("fps") && object.at("fps").is_number())
                stated.fps = std::max(0.0, object.at("fps").get<double>());
        } else {
            throw Error(ErrorCode::InvalidFile, name, "no camera file",
                        "upstream's cameras.json (an array), a transforms.json (\"frames\"), nerfstudio's "
                        "camera_path.json or a trajectory (\"schema\": \"gsc.trajectory/1\")",
                        "pass one of these");
        }
    } else {
        cameras = trainerCameras(root, name, how);
    }
    if (cameras.empty())
        throw Error(ErrorCode::InvalidFile, name, "holds no camera", "at least one", "pass another file");
    if (eyes)
        *eyes = std::move(stated);
    else if (!stated.views.empty())
        throw Error(ErrorCode::Unsupported, name, "\"views\" gives the eyes lenses and places of their own",
                    "cameras here", "gsc-play draws such a trajectory, and without \"views\" its frames are cameras");
    if (!may_be_moved && how.transform == CamerasTransform::Undo)
        how.warn(name + kNothingToUndo);
    return cameras;
}

std::vector<Camera> readCameraFile(const std::string& path, TrajectoryFacts* eyes, const CameraReading& how)
{
    if (eyes)
        *eyes = {};
    std::vector<Camera> cameras;
    for (const CameraFiles& files : findCameras(path, how)) {
        if (files.form != CameraForm::Json) {
            if (how.transform == CamerasTransform::Undo)
                how.warn(files.name + kNothingToUndo);
            std::ranges::move(readColmapCameras(files, how), std::back_inserter(cameras));
            continue;
        }
        const std::string text =
            readInputText(files.name, kMaxFileBytes, "a camera file, or \"stored\" for those in the model");
        const size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf"); // skips a byte order mark too
        if (first == std::string::npos || (text[first] != '[' && text[first] != '{'))
            throw Error(
                ErrorCode::InvalidFile, files.name,
                formatString("is %s and no JSON", text.compare(0, 4, "\x89GSC") == 0 ? "a model" : "something else"),
                "a camera file that starts with [ or {", "pass a cameras.json, a transforms.json or a trajectory");
        // a file that starts with [ is a cameras.json, beside which a trainer leaves its settings
        if (text[first] == '[')
            warnOfSettingsBeside(files.name, how);
        std::ranges::move(parseCameraFile(text, files.name, eyes, how), std::back_inserter(cameras));
    }
    return cameras;
}

} // namespace gsc
