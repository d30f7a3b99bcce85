// SPDX-License-Identifier: Apache-2.0
// Values that change with every frame. They are the base class or the first member of a kernel's arguments, so that one
// loop updates a captured graph (runtime/cuda/frame/frame_graph.h). Plain data.
#pragma once

#include "kernels/math/band.h"
#include "kernels/math/projection.h"

namespace gsc {

// Constants of an eye, for x and y, with which projection computes each Gaussian.
struct EyeLens {
    float middle[2];         // pixel where the view axis meets the image, minus one half
    float least[2], most[2]; // limits between which the trainers' code clamps the tangents of a view direction
};

inline EyeLens eyeLens(const EyeParams& eye)
{
    const float limit[2] = {1.3f * eye.tan_fov_x, 1.3f * eye.tan_fov_y};
    return {{axisPixel(eye.width, eye.focal_x, eye.tan_mid_x) - 0.5f,
             axisPixel(eye.height, eye.focal_y, eye.tan_mid_y) - 0.5f},
            {eye.tan_mid_x - limit[0], eye.tan_mid_y - limit[1]},
            {eye.tan_mid_x + limit[0], eye.tan_mid_y + limit[1]}};
}

struct FrameNow {
    EyeParams eyes[kMaxEyes];
    EyeLens lenses[kMaxEyes];
    EyeParams level_eyes[kMaxEyes]; // eyes at the viewpoints from which levels are chosen (LodLag)
    float look_from[3]; // viewpoint of the networks if they look once for both eyes (StereoMode::Merged), world units
    EyeBand bands[kMaxEyes];  // planes for each eye at the ends of `columns`
    float lod_bias, lod_fade; // FrameOptions::lod_bias and lod_fade, in levels
    float finest;             // Foveation::smallest as a variance, pixels squared
    float gaze[kMaxEyes][3];  // unit vectors along the gaze, in the axes of the eye's view
    ColumnRange columns;      // columns that are drawn, FrameOptions::columns
    uint32_t run_count; // number of the first elements of DeviceModel::runs whose anchors are already on the device
};

inline void setNow(FrameNow& args, const FrameNow& now)
{
    args = now;
}

} // namespace gsc
