// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_set.h"

#include "format/error.h"
#include "format/interrupt.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace gsc {

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
            return other.wall.median == row.wall.median && other.frames.wall_ms == row.frames.wall_ms;
        });
        if (told)
            ++runs.duplicates;
        else
            group.push_back(std::move(row));
    }
    runs.rows.clear();
    for (std::vector<RunRow>& group : groups) {
        std::stable_sort(group.begin(), group.end(),
                         [](const RunRow& a, const RunRow& b) { return a.wall.median < b.wall.median; });
        RunRow& middle = group[group.size() / 2];
        middle.repeats = group.size();
        middle.least_ms = group.front().wall.median;
        middle.most_ms = group.back().wall.median;
        runs.repeats += group.size() - 1;
        runs.rows.push_back(std::move(middle));
    }
    if (runs.duplicates)
        runs.notes.push_back(formatString("left out %llu line%s told before: the same run with the same times",
                                          static_cast<unsigned long long>(runs.duplicates),
                                          runs.duplicates == 1 ? "" : "s"));
}

} // namespace gsc
