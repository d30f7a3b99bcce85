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
    PlayOptions play;         // its size and outputs are ignored
    double scale = 1;         // width and height of pictures, in times the recommended ones
    bool stage = false;       // the first camera is at a standing viewer's eyes; else at the eyes wherever they are
    double metre = 0;         // world units per metre, 0 = the model's
    bool rides = false;       // the viewer is carried along the cameras
    double ride_fps = 72;     // cameras per second of the ride
    bool depth = false;       // the headset gets depths with its pictures
    bool waits = false;       // each frame shows the picture of its own pose
    bool late = false;        // eyes are located again when drawing of their picture begins
    double seconds = 0;       // length of the session; 0 = until the viewer ends it
    std::string log;          // file of JSON lines, empty = none; OutputChoice::overwrite applies to it
    bool keeps_place = false; // stores the viewer's place beside the model at the end
    bool falls_back = false;  // opens a window where no headset can be had
};

// Times and counts of one frame of the headset.
struct XrFrame {
    uint64_t frame = 0;       // counted from 1
    int64_t display_time = 0; // predicted display time, OpenXR's clock, ns
    double period_ms = 0;
    uint64_t missed = 0; // refreshes of the display since the frame before that had no frame
    bool visible = false, tracked = false;
    uint64_t shows = 0; // frame in which the eyes that are shown were located; 0 = nothing is shown
    bool fresh = false; // the picture was not shown before
    uint64_t age = 0;   // refreshes from frame `shows` to this one
    double off_ms = 0;  // display time minus the time that the eyes were predicted for
    double latency_ms = 0, draw_ms = 0, lod_bias = 0, detail = 0,
           fovea_pixels = 0;     // ms from submit to the end of a fresh picture, its ms of the device, its settings
    uint64_t anchors_absent = 0; // anchors of the model that a fresh picture lacks, as they are not on the device yet
    double busy_ms = 0;          // from the runtime's wake-up until the frame was ended
    double copy_ms = 0;          // GPU time of the last copy that has ended; 0 = unknown
    std::vector<std::array<float, 2>> gaze; // gazeOf() each view of a fresh picture; empty: along the axes
    std::optional<Placement> moved;         // new placement of the headset's space, if it moved since the frame before
};

struct XrSummary {
    std::string file;
    HeadsetFacts headset;
    double seconds = 0;
    uint64_t frames = 0, visible = 0, untracked = 0, missed = 0, pictures = 0, renewals = 0;
    Spread age, off_ms, busy_ms, latency_ms; // values of XrFrame; age and off_ms over frames that show a picture
    std::vector<uint64_t> ages;              // number of frames with age 0, 1, 2, ...; the last counts all older ones
    std::optional<ServiceStats> service;
    std::string place; // path of the place file that was written, empty = none
};

// Error of runXr() that the headset causes: the model may still be shown in a window.
struct HeadsetError : Error {
    explicit HeadsetError(const Error& error) : Error(error) {}
};

// Returns when the session is over. Throws Error: Unsupported without a runtime, a headset or a build with OpenXR; Device if
// the headset or every drawing device is lost; Interrupted; others as the renderer.
XrSummary runXr(const XrOptions& options, Reporter& log);

// Facts for `--info`.
HeadsetFacts headsetFacts(const XrOptions& options, Reporter& log);
OrderedJson headsetJson(const HeadsetFacts& facts); // schemas/xr-info.schema.json
std::string headsetText(const HeadsetFacts& facts);

OrderedJson xrJson(const XrSummary& summary); // schemas/xr-report.schema.json
std::string xrText(const XrSummary& summary);

} // namespace gsc
