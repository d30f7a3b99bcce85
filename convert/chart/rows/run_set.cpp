// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/rows/run_set.h"

#include "runtime/cli/reporter.h"
#include "runtime/records/row_lines.h"
#include <gsc/error.h>

#include <algorithm>
#include <functional>
#include <map>
#include <tuple>

namespace gsc {

namespace {

// Keeps the worse of two. Changes without images (equal pictures, or no two frames in a row) are never the worse.
void keepWorse(Accuracy::Changes& kept, const Accuracy::Changes& other)
{
    if (other.images > 0 && (kept.images == 0 || other.max > kept.max))
        kept = other;
}

template <typename Worse>
void keepWorse(Accuracy::Sampled& kept, const Accuracy::Sampled& other, Worse worse)
{
    if (other.frames > 0 && (kept.frames == 0 || worse(other.mean, kept.mean)))
        kept = other;
}

void keepWorse(FoveaAccuracy::Part& kept, const FoveaAccuracy::Part& other)
{
    kept.psnr_pooled = std::min(kept.psnr_pooled, other.psnr_pooled);
    kept.psnr_min = std::min(kept.psnr_min, other.psnr_min);
    kept.flip = std::max(kept.flip, other.flip);
}

void keepWorst(Accuracy& kept, const Accuracy& other)
{
    kept.psnr_pooled = std::min(kept.psnr_pooled, other.psnr_pooled);
    kept.psnr_p1 = std::min(kept.psnr_p1, other.psnr_p1);
    kept.psnr_min = std::min(kept.psnr_min, other.psnr_min);
    kept.max_error = std::max(kept.max_error, other.max_error);
    keepWorse(kept.temporal, other.temporal);
    keepWorse(kept.ssim, other.ssim, std::less<>());
    keepWorse(kept.flip, other.flip, std::greater<>());
    if (kept.fovea && other.fovea) { // repeats have equal cameras, so equal parts
        keepWorse(kept.fovea->inside, other.fovea->inside);
        keepWorse(kept.fovea->outside, other.fovea->outside);
    }
}

// The repeats of a run as one row. Precondition: at least one.
ChartRun folded(std::vector<ChartRun> group)
{
    std::stable_sort(group.begin(), group.end(),
                     [](const ChartRun& a, const ChartRun& b) { return a.ms.wall.median < b.ms.wall.median; });
    const size_t middle = group.size() / 2;
    ChartRun row = group[middle];
    if (group.size() % 2 == 0) { // the slower row's p95 is not below the mean of both medians
        const ChartRun& faster = group[middle - 1];
        double& decode = row.ms.stages[kDecodeStage].median;
        row.ms.wall.median = (row.ms.wall.median + faster.ms.wall.median) / 2;
        row.ms.device.median = (row.ms.device.median + faster.ms.device.median) / 2;
        decode = (decode + faster.ms.stages[kDecodeStage].median) / 2;
    }
    row.rounds = group.size();
    row.least_ms = group.front().ms.wall.median;
    row.most_ms = group.back().ms.wall.median;
    for (const ChartRun& other : group)
        if (row.accuracy && other.accuracy) // repeats score equal frames
            keepWorst(*row.accuracy, *other.accuracy);
    return row;
}

OrderedJson accuracyJson(const RunRow& row)
{
    return row.accuracy ? toJson(*row.accuracy) : OrderedJson();
}

} // namespace

void addRuns(std::string_view text, const std::string& path, RunSet& runs)
{
    std::map<std::string, uint64_t> others;
    forEachRow(text, path, [&](std::string_view line, const std::string& where) {
        const OrderedJson json = rowOf(line, where, "one object per line as gsc-play bench --out writes them");
        std::string schema;
        Record(json, where).field("schema", schema, kText);
        if (!isRunSchema(schema, where)) {
            Record(json, where).check("schema", schema.starts_with("gsc."), kRunSchema);
            ++others[schema];
            return;
        }
        RunRow row = runRowOf(json, where);
        if (row.curve)
            return addCurveRow(std::move(row), where, runs.curves);
        ChartRun& run = runs.rows.emplace_back(ChartRun{std::move(row)});
        run.least_ms = run.most_ms = run.ms.wall.median;
    });
    for (const auto& [schema, count] : others) {
        runs.skipped += count;
        runs.notes.push_back(formatString("%s: skipped %s of %s, which gsc chart does not draw", path.c_str(),
                                          formatCount(count, "line").c_str(), schema.c_str()));
    }
}

void foldRepeats(RunSet& runs)
{
    const auto keyOf = [](const ChartRun& row) {
        return std::make_tuple(row.file.path, row.file.bytes, row.backend, row.device.name, row.tool.version,
                               row.tool.commit, row.label, row.config.trajectory, row.config.id,
                               row.reference_file ? row.reference_file->path : std::string());
    };
    std::vector<std::vector<ChartRun>> groups;
    std::map<decltype(keyOf(runs.rows[0])), size_t> known;
    for (ChartRun& row : runs.rows) {
        const auto [found, is_new] = known.emplace(keyOf(row), groups.size());
        if (is_new)
            groups.emplace_back();
        std::vector<ChartRun>& group = groups[found->second];
        // equal times of every frame: a copy of a row, not a repeat
        const bool told = std::any_of(group.begin(), group.end(), [&](const ChartRun& other) {
            return other.ms.wall.median == row.ms.wall.median && other.wall_ms == row.wall_ms &&
                   accuracyJson(other) == accuracyJson(row);
        });
        if (told)
            ++runs.duplicates;
        else
            group.push_back(std::move(row));
    }
    runs.rows.clear();
    for (std::vector<ChartRun>& group : groups) {
        runs.repeats += group.size() - 1;
        runs.rows.push_back(folded(std::move(group)));
    }
    if (runs.duplicates)
        runs.notes.push_back("left out " + formatCount(runs.duplicates, "line") +
                             " told before: the same run with the same times");
}

} // namespace gsc
