// SPDX-License-Identifier: Apache-2.0
// The cameras that a command looks at a scene with: those stored in its file, or a camera file's.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include <gsc/camera.h>
#include <gsc/scene.h>

#include <string>
#include <utility>
#include <vector>

namespace gsc {

// `cameras`: a camera file, or "stored" or empty. Sizes and angles are the cameras' own. With `facts` the cameras of a
// file are returned as read, for the caller to finish (finishCamera()). Throws Error (Io, InvalidFile, Unsupported,
// Usage).
std::vector<Camera> sceneCameras(const Scene& scene, const std::string& cameras, const CameraReading& how,
                                 TrajectoryFacts* facts = nullptr);

// The trainer's row of the embedding that the camera asks for if the file kept it, else the first it has; -1 without embedding.
int appearanceFor(const Scene& scene, const Camera& camera);
int appearanceOf(const std::vector<uint32_t>& rows, const Camera& camera); // `rows`: Scene::appearanceRows()

// At most `most` cameras of a list, evenly spread.
template <typename T>
std::vector<T> takeEvenly(std::vector<T> all, size_t most)
{
    if (all.size() <= most)
        return all;
    std::vector<T> taken;
    for (size_t i = 0; i < most; ++i)
        taken.push_back(std::move(all[i * all.size() / most]));
    return taken;
}

} // namespace gsc
