// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/scene_cameras.h"

#include "runtime/cameras/camera_file.h"

#include <algorithm>
#include <iterator>

namespace gsc {

std::vector<Camera> sceneCameras(const Scene& scene, const std::string& cameras, const CameraReading& how)
{
    std::vector<Camera> all;
    if (!cameras.empty() && cameras != "stored") {
        all = readCameraFile(cameras, nullptr, how);
        for (Camera& camera : all)
            finishCamera(camera, 0, 0, 0);
    } else {
        for (const SourceCamera& stored : scene.cameras())
            all.push_back(cameraOf(stored));
    }
    return all;
}

int appearanceFor(const Scene& scene, const Camera& camera)
{
    const std::vector<uint32_t> rows = scene.appearanceRows();
    if (rows.empty())
        return -1;
    const bool kept =
        camera.appearance >= 0 && std::find(rows.begin(), rows.end(), uint32_t(camera.appearance)) != rows.end();
    return kept ? camera.appearance : int(rows.front());
}

FrameOptions exactOptionsFor(const Scene& scene, const Camera& camera)
{
    FrameOptions options;
    options.tier = Tier::Exact;
    if (scene.view().params->flags & kModelWhiteBackground)
        std::fill(std::begin(options.background), std::end(options.background), 1.0f);
    if (const int row = appearanceFor(scene, camera); row >= 0)
        options.appearance = scene.appearanceRow(row);
    return options;
}

} // namespace gsc
