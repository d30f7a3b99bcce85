// SPDX-License-Identifier: Apache-2.0
// All options of the command line for a run, grouped by the code that needs them. Pass on a group, not the whole.
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
    Shard shard; // part of the tasks that this process does; tasks are frames, runs of a sweep or trajectories
};

} // namespace gsc
