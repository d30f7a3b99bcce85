// SPDX-License-Identifier: Apache-2.0
// write_bench_report [text]: the report of a run on a device with round ceilings, for tests on machines that have none.
#include "player/measure/bench.h"

#include <cstdio>

int main(int argc, char**)
{
    gsc::BenchOptions options;
    options.play.model.file = "model.gsc";
    gsc::BenchSummary summary;
    summary.backend = "device";
    summary.tier = gsc::Tier::Fast;
    summary.file = {"model.gsc", 1, 1};
    summary.shots = 1;
    summary.ceilings = {3e12, 4e12, 30e12, 500e12, 4e12};
    summary.anchor_cost = {168, 3072, 3808, 32, false};
    for (int i = 1; i <= 5; ++i) { // a million of everything in the middle frame
        gsc::TimedFrame frame;
        frame.pixels = 1e6;
        gsc::EyeCounts& eye = frame.result.eyes[0];
        eye.groups_tested = eye.anchors_tested = eye.anchors_visible = eye.gaussians_visible = eye.pairs =
            uint64_t(i) * 1000000 / 3;
        eye.blend_evaluations = 100 * eye.pairs;
        frame.result.times.select = frame.result.times.decode = frame.result.times.bin = frame.result.times.blend = i;
        frame.result.times.total = frame.wall_ms = 4.0 * i;
        frame.result.bytes_resident = i == 4 ? 200 : 100; // grows once, in another frame than those drawn again
        frame.result.repeats = i == 2 ? 1 : i == 5 ? 2 : 0;
        frame.result.repeat_ms = 2.5 * frame.result.repeats;
        summary.frames.push_back(frame);
    }
    const std::string report =
        argc > 1 ? gsc::benchReportText(options, summary) : gsc::benchReportJson(options, summary);
    return std::fputs(report.c_str(), stdout) < 0;
}
