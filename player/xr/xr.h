// SPDX-License-Identifier: Apache-2.0
// gsc-play xr: shows a model in a headset, through OpenXR.
#pragma once

#include "player/options/play_options.h"
#include "player/present/headset/headset.h"
#include "player/xr/start.h"
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
    PlayOptions play; // options of drawing; the picture size and the outputs are not used
    double scale = 1; // factor on the recommended width and height of pictures
    // true: the eyes start as those of a standing viewer; false: where they are when the session begins
    bool stage = false;
    StartPlace start = StartPlace::Most;
    double metre = 0;         // world units in a metre, 0 = as the model states
    bool rides = false;       // the viewer is carried along the cameras
    double ride_fps = 72;     // cameras per second while the viewer is carried
    bool depth = false;       // the headset gets depths with its pictures
    bool waits = false;       // each frame waits for the picture of its own pose
    bool late = false;        // eyes are located again when drawing of their picture begins
    double seconds = 0;       // length of the session in seconds; 0 = until the viewer ends it
    std::string log;          // path of a log of JSON lines, empty = none; OutputChoice::overwrite applies to it
    bool keeps_place = false; // at the end, the viewer's place is stored in a file beside the model
    bool falls_back = false;  // a window is opened if there is no headset
};

// Times and counts of one frame of the headset.
struct XrFrame {
    uint64_t frame = 0;       // number of the frame, from 1
    int64_t display_time = 0; // predicted display time, OpenXR's clock, ns
    double period_ms = 0;
    uint64_t missed = 0; // refreshes of the display since the last frame for which no frame was begun
    bool visible = false, tracked = false;
    uint64_t shows = 0; // number of the frame in which the eyes of the shown picture were located; 0 = nothing is shown
    bool fresh = false; // true if the frame's picture is shown for the first time
    uint64_t age = 0;   // refreshes of the display from frame `shows` to this one
    double off_ms = 0;  // display time minus the time that the eyes were predicted for, ms
    double latency_ms = 0, draw_ms = 0, lod_bias = 0, detail = 0,
           fovea_pixels = 0;     // ms from submit to the end of a fresh picture, its ms of the device, its settings
    uint64_t anchors_absent = 0; // anchors of the model that a fresh picture lacks, as they are not on the device yet
    double busy_ms = 0;          // from the runtime's wake-up until the frame was ended
    double copy_ms = 0;          // GPU time of the last copy that has ended; 0 = unknown
    std::vector<std::array<float, 2>> gaze; // gazeOf() each view of a fresh picture; empty: along the views' axes
    std::optional<Placement> moved;         // new placement of the headset's space, if it moved since the last frame
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

// Error of runXr() that the headset causes: a window may still show the model.
struct HeadsetError : Error {
    explicit HeadsetError(const Error& error) : Error(error) {}
};

// Runs a session and returns when it is over. Throws Error: Unsupported if there is no runtime or headset, or the
// build has no OpenXR; Device if the headset or every drawing device is lost; Interrupted; others as the renderer
// throws them.
XrSummary runXr(const XrOptions& options, Reporter& log);

// Returns the facts for `--info`, without a session. Before an error is thrown `known` receives the facts found so far.
HeadsetFacts headsetFacts(const XrOptions& options, HeadsetFacts& known, Reporter& log);
OrderedJson headsetJson(const HeadsetFacts& facts); // schemas/xr-info.schema.json describes it
std::string headsetText(const HeadsetFacts& facts);
// Describes what is there though the headset cannot be opened for the reason `why`. Empty if nothing was looked for, as in a
// build without headsets.
std::string headsetText(const HeadsetFacts& known, const Error& why);

OrderedJson xrJson(const XrSummary& summary); // schemas/xr-report.schema.json describes it
std::string xrText(const XrSummary& summary);

} // namespace gsc
