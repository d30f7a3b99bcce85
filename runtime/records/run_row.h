// SPDX-License-Identifier: Apache-2.0
// One measurement as gsc-play bench, gsc-play stability and gsc bake --curve write it and gsc chart and gsc merge-runs
// read it: a line of JSON (schemas/run.schema.json).
#pragma once

#include "runtime/records/accuracy.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/records/run_parts.h"
#include "runtime/records/shard_facts.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Numbers that are 0 and texts that are empty were not given, or are not known.
struct RowConfig {
    std::string id; // hash of everything in it that changes a result
    std::string trajectory, cameras;
    uint64_t shots = 0;  // cameras that the frames go round
    uint64_t frames = 0; // drawn, each of them in wall_ms
    uint64_t warmup = 0; // the first of `frames`, or where `cold` is false frames before them: no spread has them
    bool cold = true;    // the caches were empty at the first of `frames`
    uint64_t frames_in_flight = 1;
    ReuseFacts reuse;
    std::string tier;                                      // asked for
    double lod_bias = 0, lod_fade = 0, lod_hysteresis = 0; // levels
    double detail = 0, fovea_pixels = 0;                   // pixels
    double target_ms = 0;                                  // that LOD bias and detail hold
    std::string stereo;
    uint32_t eyes = 1;
    double ipd = 0;
    std::array<uint32_t, 2> size{}; // width and height
    double fov_degrees = 0, near_z = 0;
    int appearance = -1; // row of the embedding, -1 = the cameras'
    int threads = 0;     // 0 = all
    uint64_t vram_budget = 0;
};

struct RunRow {
    ToolFacts tool;
    std::string label;
    FileFacts file;
    std::optional<FileFacts>
        reference_file; // whose exact images, where they are of another model, such as one that was baked
    std::string backend;
    std::string reference; // backend that rendered the exact images; empty: none did
    DeviceFacts device;
    RowConfig config;
    std::string rendered_tier;        // what the backend made of the tier asked for
    double open_ms = 0, load_ms = 0;  // 0: not told
    FrameTimes ms;                    // of the frames without the warm-up
    std::optional<Accuracy> accuracy; // read back, it says of what had images only that there were some
    ReuseCounts reuse;
    uint64_t peak_bytes = 0, repeats = 0;
    std::vector<double> wall_ms; // per frame, as the accuracy of frames
    std::vector<uint64_t> decoded;

    std::optional<WorkFacts> work;           // of gsc-play bench without --sweep
    std::optional<StabilityFacts> stability; // of gsc-play stability
    std::optional<CurveFacts> curve;         // of gsc bake --curve
    std::optional<ServiceFacts> service;     // of several devices
    std::vector<std::string> warnings;
    std::optional<ShardFacts> shard; // of a row that a part of a run wrote
};

constexpr const char* kRunSchema = "gsc.run/2";

void describe(const Record& at, FrameTimes& times);
void describe(const Record& at, FoveaAccuracy& accuracy);
void describe(const Record& at, Accuracy& accuracy); // without its frames
void describe(const Record& at, ReuseCounts& counts);
void describe(const Record& at, RunRow& row);

} // namespace gsc
