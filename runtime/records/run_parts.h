// SPDX-License-Identifier: Apache-2.0
// Optional parts of a row of measurements, each written and read by its describe().
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

// A stage's measured time and its least possible time, medians over the frames (player/measure/roofline.h).
struct StageRoofline {
    std::string name; // name of a stage, or "frame"
    double bytes_read = 0, bytes_written = 0, lane_operations = 0, exponentials = 0, matrix_flop = 0;
    double floor_ms = 0, measured_ms = 0;
    double percent = 0; // 100 floor_ms / measured_ms; 0 = not timed or no work
    std::string bound;  // ceiling of the device that sets floor_ms; empty = none
};

// Rooflines of all stages.
struct RooflineFacts {
    DeviceCeilings ceilings; // measured in this run, after its frames
    std::vector<StageRoofline> stages;
};

// LOD bias and detail that a frame time target chose, over the frames.
struct UsedRange {
    double mean = 0, min = 0, max = 0;
};
struct TargetFacts {
    UsedRange lod_bias, detail; // levels, pixels
};

// Range in milliseconds that holds the median frame time with a probability of 95 %.
struct MedianRange {
    double low = 0, high = 0;
};

// Counts of the work of frames. Repeats: frames drawn again because a buffer was too small.
struct WorkFacts {
    Spread ns_per_gaussian; // device time of a frame over its Gaussians on screen, all eyes
    std::array<Spread, std::size(kEyeCounts)> per_eye;
    Spread cache_bytes, cache_evictions;                 // cache of decoded Gaussians, all eyes together
    std::array<Spread, std::size(kCoarseCounts)> coarse; // groups, each once for all eyes
    double pixels_per_frame = 0;                         // pixels of all eyes
    Spread passes;                                       // ranges of depth that a frame was drawn in
    uint64_t frames_that_grew = 0;                       // frames that enlarged a buffer; none after enough warm-up
    uint64_t frames_repeated = 0;
    double repeat_ms = 0, most_repeat_ms = 0; // device time of all repeats, and of the repeats of the worst frame
    std::optional<MedianRange> wall_median;   // none for too few frames
    std::optional<TargetFacts> target;
    std::optional<RooflineFacts> roofline; // none if the device's ceilings are not known
};

// A bound on a run and the value measured against it.
struct Verdict {
    std::string bound; // "psnr", "temporal" or "p99"
    double limit = 0, value = 0;
    uint64_t frame = 0; // the worst frame, if the value is of one frame
    bool passed = true;
};

// Outcome of gsc-play stability on a trajectory.
struct StabilityFacts {
    std::vector<Verdict> verdicts; // one for each bound that was set

    [[nodiscard]] bool passed() const;
};

// A point of a curve: a model baked to a target, or the model itself.
struct CurveFacts {
    double target_psnr = -1;    // dB; -1: the model itself
    uint64_t model_anchors = 0; // anchors before baking
    uint64_t most_pixels = 0;   // largest test picture
    uint64_t archive_bytes = 0;
    std::string worst_pose;
    std::array<double, std::size(kTimedDetails)> detail_ms{}; // medians, tier fast
};

// A worker of a service: counts and times of its work.
struct WorkerFacts {
    std::string device, name, state;
    uint64_t parts = 0;
    double busy_ms = 0, load_ms = 0;
    uint64_t starts = 0, stops = 0, faults = 0;
    std::string last_fault; // empty = none
};

// Several devices that shared the frames.
struct ServiceFacts {
    std::string mode;
    uint64_t sharing = 0; // workers that draw
    std::string cause;    // reason of the plan; empty = none
    struct Wire {         // bytes that crossed the network, and the pixels and depths among them
        uint64_t bytes = 0, picture_bytes = 0;
    };
    std::optional<Wire> wire; // only with workers on other machines
    std::vector<WorkerFacts> list;
};

void describe(const Record& at, UsedRange& used);
void describe(const Record& at, TargetFacts& target);
void describe(const Record& at, MedianRange& range);
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
