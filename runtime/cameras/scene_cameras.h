// SPDX-License-Identifier: Apache-2.0
// Reads the cameras for a scene: those stored in the .gsc file, or those of a camera file.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include <gsc/camera.h>
#include <gsc/scene.h>

#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Reads cameras. `cameras` is the path of a camera file; "stored" or empty stands for those in the .gsc file. The
// cameras keep their sizes and angles. With `facts` the cameras of a file are returned as read, and the caller has to
// finish them (finishCamera()). Throws Error (Io, InvalidFile, Unsupported, Usage).
std::vector<Camera> sceneCameras(const Scene& scene, const std::string& cameras, const CameraReading& how,
                                 TrajectoryFacts* facts = nullptr);

// Returns the row of the trainer's appearance embedding for a camera: the camera's own row if the file has it, else
// the first row; -1 if there is no embedding.
int appearanceFor(const Scene& scene, const Camera& camera);
// `rows` is the result of Scene::appearanceRows()
int appearanceOf(const std::vector<uint32_t>& rows, const Camera& camera);

// Returns at most `most` cameras of a list, evenly spread over it.
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
