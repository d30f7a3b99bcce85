// SPDX-License-Identifier: Apache-2.0
// All that a command line says of a run, by who needs it: pass on a part, not the whole.
#pragma once

#include "player/options/camera_choice.h"
#include "player/options/device_choice.h"
#include "player/options/frame_choice.h"
#include "player/options/output_choice.h"
#include "player/options/shard.h"

namespace gsc {

struct PlayOptions {
    ModelChoice model;
    CameraChoice cameras;
    ViewChoice view;
    FrameChoice frame;
    DeviceChoice devices;
    OutputChoice output;
    Shard shard; // tasks that this process does: frames, rows of a sweep or trajectories
};

} // namespace gsc
