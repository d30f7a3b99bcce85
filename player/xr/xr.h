// SPDX-License-Identifier: Apache-2.0
// gsc-play xr: a model in a headset, through OpenXR.
#pragma once

#include "player/options/play_options.h"
#include "player/present/headset/headset.h"
#include "runtime/records/report_parts.h"
#include "runtime/cli/json.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/service_trace.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct XrOptions {
    PlayOptions play;         // its size and outputs are not used
    double scale = 1;         // of the recommended size of pictures, each side
    bool stage = false;       // the viewer stands on the floor of the room; otherwise eyes start at the camera
    double metre = 0;         // world units, 0 = the model's
    bool rides = false;       // along the cameras, at their pace
    double ride_fps = 72;     // cameras a second
    bool depth = false;       // the headset gets depths with its pictures
    bool waits = false;       // each frame shows the picture of its own pose
    bool late = false;        // eyes are looked up again when their picture is begun
    double seconds = 0;       // after which the session is asked to end; 0 = when the person ends it
    std::string log;          // file of JSON lines, empty = none; OutputChoice::overwrite is its
    bool keeps_place = false; // the place of the viewer is stored beside the model at the end
    bool falls_back = false;  // to the window, where no headset can be had
};

// Times and counts of one frame of the headset.
struct XrFrame {
    uint64_t frame = 0;       // from 1
    int64_t display_time = 0; // of OpenXR's clock, ns
    double period_ms = 0;
    uint64_t missed = 0; // refreshes between the frame before and this one that had none
    bool visible = false, tracked = false;
    uint64_t shows = 0; // frame in which the eyes that are shown were located; 0 = nothing is shown
    bool fresh = false; // they were not shown before
    uint64_t age = 0;   // refreshes from then to this frame
    double off_ms = 0;  // when they are seen, less when they were located for
    double latency_ms = 0, draw_ms = 0, lod_bias = 0, detail = 0,
           fovea_pixels = 0;                // of a fresh picture: from submit until it was there; of the device
    uint64_t anchors_absent = 0;            // of a fresh picture: of the model, from it
    double busy_ms = 0;                     // from the runtime's wake-up until the frame was ended
    double copy_ms = 0;                     // of the GPU, of the last copy that is done; 0 = unknown
    std::vector<std::array<float, 2>> gaze; // of a fresh picture: gazeOf() each view; empty: along the axes
    std::optional<Placement> moved;         // where the headset's space is, if not where it was in the frame before
};

struct XrSummary {
    std::string file;
    HeadsetFacts headset;
    double seconds = 0;
    uint64_t frames = 0, visible = 0, untracked = 0, missed = 0, pictures = 0, renewals = 0;
    Spread age, off_ms, busy_ms, latency_ms; // XrFrame's; the first two of frames that show something
    std::vector<uint64_t> ages;              // frames whose age is 0, 1, 2, ... ; the last: that and more
    std::optional<ServiceStats> service;
    std::string place; // file that was written, empty = none
};

// Error of runXr() where the headset is the reason: another way of showing the model may do.
struct HeadsetError : Error {
    explicit HeadsetError(const Error& error) : Error(error) {}
};

// Returns when the session is over. Throws Error: Unsupported without a runtime, a headset or a build that has one; Device
// where they or every device that draws are lost; Interrupted; others as the renderer has them.
XrSummary runXr(const XrOptions& options, Reporter& log);

// Facts that `--info` tells.
HeadsetFacts headsetFacts(const XrOptions& options, Reporter& log);
OrderedJson headsetJson(const HeadsetFacts& facts); // schemas/xr-info.schema.json
std::string headsetText(const HeadsetFacts& facts);

OrderedJson xrJson(const XrSummary& summary); // schemas/xr-report.schema.json
std::string xrText(const XrSummary& summary);

} // namespace gsc
