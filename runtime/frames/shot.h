// SPDX-License-Identifier: Apache-2.0
// A pose that is drawn: a camera, the eyes about it and the embedding row; and the options of a frame of it.
#pragma once

#include <gsc/camera.h>
#include <gsc/scene.h>

#include <cstdint>
#include <optional>

namespace gsc {

struct Shot {
    Camera camera;                   // the only eye, or the middle between two that are `ipd` apart
    uint64_t index = 0;              // in the camera file
    int appearance = -1;             // the trainer's embedding row; -1 if the model has none
    double ipd = 0;                  // distance between two eyes, world units; 0 = one eye, or views say where they are
    std::optional<Camera> right_eye; // right eye of a trajectory with views; `camera` is then the left one
    double origin[3] = {};           // ModelView::origin of the scene that is rendered
};

// One eye at a camera, with appearanceFor().
Shot shotOf(const Scene& scene, const Camera& camera);

// The eyes of a shot, one or two, as its scene's backend takes them.
void shotEyes(const Shot& shot, uint32_t eye_count, EyeParams* eyes);

// Row of EMBD, as FrameOptions wants it.
int32_t shotAppearance(const Scene& scene, const Shot& shot);

// The model's own background, and otherwise the default.
FrameOptions modelOptions(const Scene& scene);

// Leaves nothing out of `frame`: the picture that it is compared with.
FrameOptions exactOptions(FrameOptions frame);

// Options that the trainer draws the camera with: exactOptions(modelOptions()), appearanceFor().
FrameOptions exactOptionsFor(const Scene& scene, const Camera& camera);

} // namespace gsc
