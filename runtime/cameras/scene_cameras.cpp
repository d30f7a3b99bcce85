// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/scene_cameras.h"

#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/trainer_cameras.h"

#include <algorithm>

namespace gsc {

std::vector<Camera> sceneCameras(const Scene& scene, const std::string& cameras, const CameraReading& how,
                                 TrajectoryFacts* facts)
{
    std::vector<Camera> all;
    if (!cameras.empty() && cameras != "stored") {
        all = readCameraFile(cameras, facts, how);
        for (Camera& camera : all)
            if (facts == nullptr)
                finishCamera(camera, 0, 0, 0);
    } else {
        for (const SourceCamera& stored : scene.cameras())
            all.push_back(cameraOf(stored));
    }
    return all;
}

int appearanceOf(const std::vector<uint32_t>& rows, const Camera& camera)
{
    if (rows.empty())
        return -1;
    const bool kept =
        camera.appearance >= 0 && std::binary_search(rows.begin(), rows.end(), uint32_t(camera.appearance));
    return kept ? camera.appearance : int(rows.front());
}

int appearanceFor(const Scene& scene, const Camera& camera)
{
    return appearanceOf(scene.appearanceRows(), camera);
}

} // namespace gsc
