// SPDX-License-Identifier: Apache-2.0
// Values that change with every frame. They are the base or the first member of a kernel's arguments, so that one loop
// updates a captured graph (runtime/cuda/frame/frame_graph.h). Plain data.
#pragma once

#include "kernels/math/band.h"
#include "kernels/math/projection.h"

namespace gsc {

// Constants of an eye, along x and y, that projection uses for each Gaussian.
struct EyeLens {
    float middle[2];         // pixel that the view axis meets, minus one half
    float least[2], most[2]; // tangents that upstream clamps to
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
    EyeParams level_eyes[kMaxEyes]; // eyes at the places that levels are chosen from (LodLag)
    float look_from[3];             // viewpoint of networks that look once for both eyes (StereoMode::Merged)
    EyeBand bands[kMaxEyes];        // planes of `columns` for each eye
    float lod_bias, lod_fade;       // FrameOptions
    float finest;                   // Foveation::smallest, as a variance
    float gaze[kMaxEyes][3];        // unit vectors in the view's axes
    ColumnRange columns;            // FrameOptions
    uint32_t run_count;             // the first group runs of DeviceModel::runs, whose anchors are on the device
};

inline void setNow(FrameNow& args, const FrameNow& now)
{
    args = now;
}

} // namespace gsc
