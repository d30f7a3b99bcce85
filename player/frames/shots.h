// SPDX-License-Identifier: Apache-2.0
// What a run renders: cameras, embedding rows and frame options, chosen by the command line and the file.
#pragma once

#include "player/options/camera_choice.h"
#include "player/options/frame_choice.h"
#include "runtime/cli/reporter.h"
#include <gsc/camera.h>
#include <gsc/scene.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace gsc {

struct Shot {
    Camera camera;                   // the only eye, or the middle between two that are `ipd` apart
    uint64_t index = 0;              // in the camera file
    int appearance = -1;             // the trainer's embedding row; -1 if the model has none
    double ipd = 0;                  // of two eyes, world units; 0 = one eye, or views say where they are
    std::optional<Camera> right_eye; // of a trajectory with views; `camera` is then the left one
    double origin[3] = {};           // ModelView::origin of the scene that is rendered
};

// At least one. `title`, if given, takes the name that a trajectory states, empty if none. Warns where an embedding row
// had to be chosen for a camera and where distortion is ignored. `model` is the scene's file. Throws Error (Usage, Io,
// InvalidFile, Unsupported).
std::vector<Shot> chooseShots(const Scene& scene, const std::string& model, const CameraChoice& from,
                              const ViewChoice& view, Reporter& log, std::string* title = nullptr);

// Background, near plane, tier, stereo, what is said of levels, and reuse; the appearance is the shot's.
FrameOptions frameOptions(const Scene& scene, const FrameChoice& choice);

// The same with nothing left out: what `frame` is compared with.
FrameOptions exactOptions(FrameOptions frame);

// The eyes of a shot, one or two, as its scene's backend takes them.
void shotEyes(const Shot& shot, uint32_t eye_count, EyeParams* eyes);

// Row of EMBD, as FrameOptions wants it.
int32_t shotAppearance(const Scene& scene, const Shot& shot);

} // namespace gsc
