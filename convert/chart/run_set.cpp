// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_set.h"

#include "format/error.h"
#include "format/interrupt.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <tuple>

namespace gsc {

namespace {

template <typename T, typename Worse>
void keepWorse(T& value, const T& other, Worse worse)
{
    if (worse(other, value))
        value = other;
}

template <typename Worse>
void keepWorse(std::optional<double>& value, const std::optional<double>& other, Worse worse)
{
    if (other && (!value || worse(*other, *value)))
        value = other;
}

void keepWorst(RunAccuracy& kept, const RunAccuracy& other)
{
    keepWorse(kept.psnr_pooled, other.psnr_pooled, std::less<>());
    keepWorse(kept.psnr_p1, other.psnr_p1, std::less<>());
    keepWorse(kept.psnr_min, other.psnr_min, std::less<>());
    keepWorse(kept.max_error, other.max_error, std::greater<>());
    keepWorse(kept.temporal_max, other.temporal_max, std::greater<>());
    keepWorse(kept.ssim_mean, other.ssim_mean, std::less<>());
    keepWorse(kept.flip_mean, other.flip_mean, std::greater<>());
}

// `group` holds at least one row.
RunRow folded(std::vector<RunRow> group)
{
    std::stable_sort(group.begin(), group.end(),
                     [](const RunRow& a, const RunRow& b) { return a.wall.median < b.wall.median; });
    const size_t middle = group.size() / 2;
    RunRow row = group[middle];
    if (group.size() % 2 == 0) { // as near to the mean as the other, and its p95 is not below it
        const RunRow& faster = group[middle - 1];
        row.wall.median = (row.wall.median + faster.wall.median) / 2;
        row.device_ms.median = (row.device_ms.median + faster.device_ms.median) / 2;
        row.decode_ms = (row.decode_ms + faster.decode_ms) / 2;
    }
    row.repeats = group.size();
    row.least_ms = group.front().wall.median;
    row.most_ms = group.back().wall.median;
    for (const RunRow& other : group)
        keepWorst(row.accuracy, other.accuracy);
    return row;
}

} // namespace

void addRuns(std::string_view text, const std::string& path, RunSet& runs)
{
    std::map<std::string, uint64_t> others;
    uint64_t number = 0;
    while (!text.empty()) {
        throwIfInterrupted();
        ++number;
        const size_t end = text.find('\n');
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(end == text.npos ? text.size() : end + 1);
        if (line.find_first_not_of(" \t\r") == line.npos)
            continue;
        std::string other;
        const std::string where = formatString("%s:%llu", path.c_str(), static_cast<unsigned long long>(number));
        if (auto row = parseRunLine(line, where, other))
            runs.rows.push_back(std::move(*row));
        else
            ++others[other];
    }
    for (const auto& [schema, count] : others) {
        runs.skipped += count;
        runs.notes.push_back(formatString("%s: skipped %llu line%s of %s, which gsc chart does not draw", path.c_str(),
                                          static_cast<unsigned long long>(count), count == 1 ? "" : "s",
                                          schema.c_str()));
    }
}

void foldRepeats(RunSet& runs)
{
    const auto keyOf = [](const RunRow& row) {
        return std::make_tuple(row.file, row.file_bytes, row.backend, row.device, row.version, row.commit, row.label,
                               row.config.trajectory, row.config.id);
    };
    std::vector<std::vector<RunRow>> groups;
    std::map<decltype(keyOf(runs.rows[0])), size_t> known;
    for (RunRow& row : runs.rows) {
        const auto [found, is_new] = known.emplace(keyOf(row), groups.size());
        if (is_new)
            groups.emplace_back();
        std::vector<RunRow>& group = groups[found->second];
        // no clock tells the same times for every frame twice
        const bool told = std::any_of(group.begin(), group.end(), [&](const RunRow& other) {
            return other.wall.median == row.wall.median && other.frames.wall_ms == row.frames.wall_ms &&
                   other.accuracy == row.accuracy;
        });
        if (told)
            ++runs.duplicates;
        else
            group.push_back(std::move(row));
    }
    runs.rows.clear();
    for (std::vector<RunRow>& group : groups) {
        runs.repeats += group.size() - 1;
        runs.rows.push_back(folded(std::move(group)));
    }
    if (runs.duplicates)
        runs.notes.push_back(formatString("left out %llu line%s told before: the same run with the same times",
                                          static_cast<unsigned long long>(runs.duplicates),
                                          runs.duplicates == 1 ? "" : "s"));
}

} // namespace gsc
