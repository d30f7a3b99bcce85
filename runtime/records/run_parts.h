// SPDX-License-Identifier: Apache-2.0
// Parts that only some rows of measurements have, each written and read by its describe().
#pragma once

#include "runtime/records/frame_numbers.h"
#include "runtime/records/timed_details.h"

#include <gsc/device.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// A stage of a frame against the least work that it must do, medians over the frames (player/measure/roofline.h).
struct StageRoofline {
    std::string name; // of a stage, or "frame"
    double bytes_read = 0, bytes_written = 0, lane_operations = 0, exponentials = 0, matrix_flop = 0;
    double floor_ms = 0, measured_ms = 0;
    double percent = 0; // of the ceiling that binds; 0 = not timed or no work
    std::string bound;  // that ceiling; empty = none
};

struct RooflineFacts {
    DeviceCeilings ceilings; // measured in this run, behind the frames
    std::vector<StageRoofline> stages;
};

// Levels and detail that held a target for the frame time.
struct UsedRange {
    double mean = 0, min = 0, max = 0;
};
struct TargetFacts {
    UsedRange lod_bias, detail; // levels, pixels
};

// Counts of what frames did. Repeats: frames drawn again because a buffer was too small.
struct WorkFacts {
    Spread ns_per_gaussian; // device time of a frame over its Gaussians on screen, all eyes
    std::array<Spread, std::size(kEyeCounts)> per_eye;
    Spread cache_bytes, cache_evictions;                 // of decoded Gaussians, all eyes together
    std::array<Spread, std::size(kCoarseCounts)> coarse; // groups, each once for all eyes
    double pixels_per_frame = 0;                         // all eyes
    Spread passes;                                       // of depth
    uint64_t frames_that_grew = 0;                       // that enlarged a buffer; none after enough warm-up
    uint64_t frames_repeated = 0;
    double repeat_ms = 0, most_repeat_ms = 0; // device time of the repeats: of all frames, of the worst
    std::optional<TargetFacts> target;
    std::optional<RooflineFacts> roofline; // none where the device's ceilings are not known
};

struct Verdict {
    std::string bound; // "psnr", "temporal" or "p99"
    double limit = 0, value = 0;
    uint64_t frame = 0; // the worst, where there is one
    bool passed = true;
};

struct StabilityFacts {
    std::vector<Verdict> verdicts; // of the bounds that were set

    [[nodiscard]] bool passed() const;
};

// A model baked to a target, or the model itself.
struct CurveFacts {
    double target_psnr = -1;    // dB; -1: the model itself
    uint64_t model_anchors = 0; // of the model itself
    uint64_t most_pixels = 0;   // of a picture that judged
    uint64_t archive_bytes = 0;
    std::string worst_pose;
    std::array<double, std::size(kTimedDetails)> detail_ms{}; // medians, tier fast
};

struct WorkerFacts {
    std::string device, name, state;
    uint64_t parts = 0;
    double busy_ms = 0, load_ms = 0;
    uint64_t starts = 0, stops = 0, faults = 0;
    std::string last_fault; // empty = none
};

struct ServiceFacts {
    std::string mode;
    uint64_t sharing = 0; // workers that draw
    std::string cause;    // of that plan; empty = none
    struct Wire {
        uint64_t bytes = 0, picture_bytes = 0;
    };
    std::optional<Wire> wire; // of workers on other machines
    std::vector<WorkerFacts> list;
};

void describe(const Record& at, UsedRange& used);
void describe(const Record& at, TargetFacts& target);
void describe(const Record& at, DeviceCeilings& ceilings);
void describe(const Record& at, StageRoofline& stage);
void describe(const Record& at, RooflineFacts& roofline);
void describe(const Record& at, Verdict& verdict);
void describe(const Record& at, WorkerFacts& worker);
void describe(const Record& at, ServiceFacts::Wire& wire);
void describe(const Record& at, WorkFacts& work);
void describe(const Record& at, StabilityFacts& stability);
void describe(const Record& at, CurveFacts& curve);
void describe(const Record& at, ServiceFacts& service);

} // namespace gsc
