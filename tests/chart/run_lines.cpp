// SPDX-License-Identifier: Apache-2.0
#include "tests/chart/run_lines.h"

namespace gsc {

nlohmann::json plainRun()
{
    nlohmann::json line = nlohmann::json::parse(R"({
        "schema": "gsc.run/2",
        "tool": {"name": "gsc-play", "version": "0.1.0", "commit": "0a1b2c3"},
        "label": "",
        "file": {"path": "models/fox.gsc", "bytes": 4096, "anchors": 26056},
        "backend": "cpu",
        "reference": "cpu",
        "device": {"name": "EPYC", "driver": null, "memory_bytes": 1024, "processors": 2, "clock_mhz": null,
                   "memory_clock_mhz": null, "context_bytes": null},
        "config": {"id": "00", "trajectory": "walk", "cameras": "walk.json", "shots": 2, "frames": 2,
                   "warmup": 0, "cold": true, "frames_in_flight": 1,
                   "policy": "none", "max_depth": null, "guidance": null, "bound": null, "decode_budget": null,
                   "cache_budget": null, "tier": "fast", "lod_bias": 0,
                   "lod_fade": 0, "lod_hysteresis": 0, "detail": 0, "fovea_pixels": null, "target_ms": null,
                   "stereo": "exact", "eyes": 1, "ipd": null, "size": [640, 480], "fov_degrees": null, "near": null,
                   "appearance": null, "threads": 0, "vram_budget": null},
        "rendered_tier": "fast",
        "ms": {"open": null, "load": null, "wall": {"mean": 4, "median": 4, "p95": 5, "p99": 6, "max": 7},
               "device": {"mean": 3, "median": 3, "p95": 3, "p99": 3, "max": 3}, 
               "stages": {"decode": {"mean": 1.5, "median": 1.25, "p95": 2, "p99": 2, "max": 2}}},
        "accuracy": {"scored": {"first": 0, "every": 1}, "psnr": {"pooled": null, "p1": null, "min": null, "min_frame": 0}, "max_error": 0,
                     "over_1_255": 0, "ssim": null, "flip": null,
                     "temporal": {"rms": 0, "p50": 0, "p99": 0, "max": 0, "max_frame": 1},
                     "motion": null, "pop": null, "error_pop": null},
        "reuse": {"decoded_per_frame": {"mean": 10, "median": 10, "p95": 10, "p99": 10, "max": 10},
                  "reused_per_frame": {"mean": 0, "median": 0, "p95": 0, "p99": 0, "max": 0},
                  "hit_rate": 0, "overdue": 0, "evictions": 0, "cache_bytes": 0},
        "peak_bytes": 1048576,
        "repeats": 0,
        "warnings": [],
        "per_frame": {"wall_ms": [4, 4.25], "psnr": [null, null], "temporal": [null, 0], "decoded": [10, 10]}
    })");
    nlohmann::json& stages = line["ms"]["stages"];
    for (const char* stage : {"select", "project", "bin", "sort", "blend"})
        stages[stage] = stages["decode"];
    return line;
}

nlohmann::json runOf(const std::string& policy, double ms, const nlohmann::json& psnr)
{
    static int count = 0;
    nlohmann::json line = plainRun();
    line["config"]["policy"] = policy;
    line["config"]["id"] = std::to_string(++count);
    line["ms"]["wall"]["median"] = ms;
    line["accuracy"]["psnr"] = {{"pooled", psnr}, {"p1", psnr}, {"min", psnr}, {"min_frame", 0}};
    line["accuracy"]["max_error"] = psnr.is_null() ? 0 : 0.125;
    return line;
}

ChartRun parsed(const nlohmann::json& line)
{
    RunSet runs;
    addRuns(line.dump(), "runs.jsonl", runs);
    return runs.rows.at(0);
}

std::vector<ChartRun> hostileRuns()
{
    const char* const kHostile = "</script><script>alert(1)</script><!-- & \"quoted\" 'x' {a|b} @MODEL@ \xe2\x80\xa8";
    nlohmann::json one = runOf("none", 6, nullptr), two = runOf("error", 2, 40);
    for (nlohmann::json* line : {&one, &two}) {
        (*line)["config"]["trajectory"] = kHostile;
        (*line)["file"]["path"] = kHostile;
        (*line)["label"] = kHostile;
    }
    two["config"]["policy"] = kHostile;
    return {parsed(one), parsed(two)};
}

} // namespace gsc
