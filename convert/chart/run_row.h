// SPDX-License-Identifier: Apache-2.0
// One line of gsc-play bench --sweep (gsc.run/1), as far as the charts need it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

constexpr double kBrokenPsnr = -999;

// Order statistics of a run's frames.
struct RunSpread {
    double mean = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};

struct RunConfig {
    std::string id; // hash of everything in it that changes a result
    std::string trajectory, cameras;
    uint64_t frames = 0, warmup = 0;
    bool cold = false; // the caches were empty at the first frame measured
    std::string policy;
    std::optional<uint64_t> max_depth;
    std::string guidance;                                             // empty: policy has none
    std::optional<double> bound;                                      // 1/255 units
    std::optional<uint64_t> decode_budget, cache_budget, vram_budget; // anchors per frame, bytes, bytes
    std::string tier;
    double lod_bias = 0, lod_fade = 0, lod_hysteresis = 0; // levels
    std::string stereo;
    uint64_t eyes = 1;
    std::optional<double> ipd, fov_degrees, near_z;
    std::optional<uint64_t> width, height, appearance;
    uint64_t threads = 0; // 0 = all
};

// Against tier exact, policy none, same poses. Decibels are +infinity where the images are equal and
// kBrokenPsnr where a pixel is not finite.
struct RunAccuracy {
    double psnr_pooled = 0, psnr_p1 = 0, psnr_min = 0;
    double max_error = 0;               // of 1
    std::optional<double> temporal_max; // of 1; none with a single frame
    std::optional<double> ssim_mean, flip_mean;

    bool operator==(const RunAccuracy&) const = default;
};

// One value per frame, all of one length; NaN where there is none, +infinity where images are equal.
struct RunFrames {
    std::vector<double> wall_ms, psnr, temporal, decoded;
};

struct RunRow {
    std::string tool, version, commit; // commit: empty where not known
    std::string label;
    std::string file;
    uint64_t file_bytes = 0, anchors = 0;
    std::string backend, device, driver;
    uint64_t device_memory = 0;
    RunConfig config;
    std::string rendered_tier; // what the backend made of the tier asked for
    std::string reference;     // backend that rendered the exact images; empty: not told
    RunSpread wall, device_ms; // milliseconds
    double decode_ms = 0;      // of it the stage decode, median
    RunAccuracy accuracy;
    double decoded_per_frame = 0; // anchors, all eyes, mean
    std::optional<double> hit_rate;
    uint64_t cache_bytes = 0, peak_bytes = 0;
    RunFrames frames;
    // How often the run was measured, and its median frame time in those repeats, from the least to the most. With
    // more than one, `accuracy` is the worst of all.
    uint64_t repeats = 1;
    double least_ms = 0, most_ms = 0;
};

// `where` names the line in messages, such as "runs.jsonl:12". Returns the row, or nothing for a line of another known
// form (gsc.bench/1), whose schema then is in `other`. Throws Error: InvalidFile (no JSON, a field missing or wrong),
// Unsupported (a newer gsc.run).
std::optional<RunRow> parseRunLine(std::string_view line, const std::string& where, std::string& other);

} // namespace gsc
