// SPDX-License-Identifier: Apache-2.0
// A shot: a camera, the eyes about it and the row of the appearance embedding; and the options of a frame that shows
// it.
#pragma once

#include <gsc/camera.h>
#include <gsc/scene.h>

#include <array>
#include <cstdint>
#include <optional>

namespace gsc {

struct Shot {
    Camera camera;       // the only eye, or the middle between two that are `ipd` apart
    uint64_t index = 0;  // index of the camera in the camera file
    int appearance = -1; // row of the trainer's appearance embedding; -1 if the model has none
    double ipd = 0;      // distance between two eyes, world units; 0 = one eye, or right_eye is set
    // right eye, if a trajectory states a view for each eye; `camera` is then the left one
    std::optional<Camera> right_eye;
    double origin[3] = {};                 // ModelView::origin of the scene that is rendered
    std::array<double, 3> up = {0, -1, 0}; // direction up in the world: worldUp() of all cameras of the file
};

// Returns a shot with one eye, at a camera; its appearance is that of appearanceFor().
Shot shotOf(const Scene& scene, const Camera& camera);

// Returns the one or two eyes of a shot as renderers of its scene take them.
void shotEyes(const Shot& shot, uint32_t eye_count, EyeParams* eyes);

// Returns the row in the section EMBD that FrameOptions::appearance wants.
int32_t shotAppearance(const Scene& scene, const Shot& shot);

// Frame options with the model's own background; everything else is the default.
FrameOptions modelOptions(const Scene& scene);

// Returns `frame` with all that leaves something out switched off: options of the picture that others are compared
// with.
FrameOptions exactOptions(FrameOptions frame);

// Options with which the trainer draws the camera: exactOptions(modelOptions()), with the row of appearanceFor().
FrameOptions exactOptionsFor(const Scene& scene, const Camera& camera);

} // namespace gsc
