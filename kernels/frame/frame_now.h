// SPDX-License-Identifier: Apache-2.0
// What every frame has anew. The arguments of every kernel that needs it derive from it, so that a captured graph is
// brought up to date by one loop (runtime/cuda/frame_graph.h). Plain data.
#pragma once

#include "kernels/frame/frame_types.h"

namespace gsc {

struct FrameNow {
    EyeParams eyes[kMaxEyes];
    EyeParams level_eyes[kMaxEyes]; // the same but for their centres, which are where levels are chosen from (LodLag)
    float look_from[3];             // of networks that look once for both eyes (StereoMode::Merged)
    float lod_bias, lod_fade;       // FrameOptions
};

inline void setNow(FrameNow& args, const FrameNow& now)
{
    args = now;
}

} // namespace gsc
