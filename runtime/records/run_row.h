// SPDX-License-Identifier: Apache-2.0
// A row: one measurement as a line of JSON (schemas/run.schema.json). gsc-play bench, gsc-play stability and gsc bake --curve
// write it, gsc chart and gsc merge-runs read it.
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

// Settings of a run. A number that is 0 and a text that is empty: not given, or not known.
struct RowConfig {
    std::string id; // hash of every setting that changes a result
    std::string trajectory, cameras;
    uint64_t shots = 0;  // cameras, which frames take in turn, again and again
    uint64_t frames = 0; // drawn frames; wall_ms has each of them
    uint64_t warmup = 0; // frames that no Spread has: the first of `frames` if `cold`, else frames before them
    bool cold = true;    // the caches were empty at the first of `frames`
    uint64_t frames_in_flight = 1;
    ReuseFacts reuse;
    std::string tier;                                      // requested tier, one of tiers()
    double lod_bias = 0, lod_fade = 0, lod_hysteresis = 0; // levels
    double detail = 0, fovea_pixels = 0;                   // pixels
    double target_ms = 0;                                  // frame time that LOD bias and detail are adjusted to
    std::string stereo;
    uint32_t eyes = 1;
    double ipd = 0;                     // distance between the eyes, world units
    std::array<uint32_t, 2> size{};     // width and height, pixels
    double fov_degrees = 0, near_z = 0; // horizontal; near plane in world units
    int appearance = -1;                // row of the embedding, -1 = the cameras'
    int threads = 0;                    // 0 = all
    uint64_t vram_budget = 0;           // bytes
};

// A row: program, file, device, settings and results.
struct RunRow {
    ToolFacts tool;
    std::string label;
    FileFacts file;
    std::optional<FileFacts>
        reference_file; // model of the exact images, unless it is `file`: such as the model before baking
    std::string backend;
    std::string reference; // backend that drew the exact images; empty: nothing was scored
    DeviceFacts device;
    RowConfig config;
    std::string rendered_tier;        // tier that the backend drew, for config.tier
    double open_ms = 0, load_ms = 0;  // milliseconds; 0: not known
    FrameTimes ms;                    // frames without the warm-up
    std::optional<Accuracy> accuracy; // after reading, its counts of images only tell none from some
    ReuseCounts reuse;
    uint64_t peak_bytes = 0, repeats = 0;
    std::vector<double> wall_ms;   // one for each of config.frames
    std::vector<uint64_t> decoded; // anchors per frame

    std::optional<WorkFacts> work;           // only of gsc-play bench without --sweep
    std::optional<StabilityFacts> stability; // only of gsc-play stability
    std::optional<CurveFacts> curve;         // only of gsc bake --curve
    std::optional<ServiceFacts> service;     // only of several devices
    std::vector<std::string> warnings;
    std::optional<ShardFacts> shard; // only of a row that a shard wrote
};

constexpr const char* kRunSchema = "gsc.run/2";

void describe(const Record& at, FrameTimes& times);
void describe(const Record& at, FoveaAccuracy& accuracy);
void describe(const Record& at, Accuracy& accuracy); // without the values of single frames
void describe(const Record& at, ReuseCounts& counts);
void describe(const Record& at, RunRow& row);

} // namespace gsc
