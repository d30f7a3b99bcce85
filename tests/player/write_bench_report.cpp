// SPDX-License-Identifier: Apache-2.0
// write_bench_report [text]: the report of a run on a device with round ceilings, for tests on machines that have none.
#include "player/measure/run_facts.h"
#include "player/measure/run_text.h"
#include "player/measure/work_facts.h"

#include <cstdio>

int main(int argc, char**)
{
    gsc::RunConfig run;
    run.backend = "device";
    gsc::RunContext context;
    context.file = {"model.gsc", 1, 1};
    context.measured = 5;
    gsc::Path path;
    path.name = path.cameras = "stored";
    path.shots.resize(1);
    gsc::RunResult result;
    result.tier = gsc::Tier::Fast;
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
        result.frames.push_back(frame);
    }
    gsc::RunRow row = gsc::runRow(context, gsc::rowConfig(context, path, run), run.backend, result);
    const gsc::WorkContext work{run, 1, 1, 0, {168, 3072, 3808, 32, false}, {3e12, 4e12, 30e12, 500e12, 4e12}};
    row.work = gsc::workFacts(work, result.frames);
    const std::string text = argc > 1 ? gsc::benchText(row) : gsc::jsonText(gsc::toJson(row), -1);
    return std::fputs(text.c_str(), stdout) < 0;
}
