// SPDX-License-Identifier: Apache-2.0
// Chooses the cameras of a run: those of a file, some of them, or cameras made of them (made_cameras.h).
#pragma once

#include "player/options/camera_choice.h"
#include "runtime/cameras/camera_reading.h"
#include "runtime/cli/reporter.h"
#include <gsc/scene.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct ChosenCameras {
    std::vector<Camera> cameras;   // at least one; not finished (finishCamera()), except those of a way
    std::vector<uint64_t> numbers; // number of each in its file, counted from 0; of cameras that are made, in order
    TrajectoryFacts facts;         // fps is never 0
    std::array<double, 3> up{};    // worldUp() of all cameras of the file
};

// Reads the cameras; warns of what was assumed. `model` is the path of the scene's file. Throws Error (Usage, Io,
// InvalidFile, Unsupported).
ChosenCameras chooseCameras(const Scene& scene, const std::string& model, const CameraChoice& choice,
                            const ViewChoice& view, Reporter& log);

} // namespace gsc
