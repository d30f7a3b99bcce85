// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_set.h"

#include "format/error.h"
#include "format/interrupt.h"

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

void dropRepeatedRuns(RunSet& runs)
{
    const auto keyOf = [](const RunRow& row) {
        return std::make_tuple(row.file, row.file_bytes, row.backend, row.device, row.version, row.commit, row.label,
                               row.config.trajectory, row.config.id);
    };
    std::map<decltype(keyOf(runs.rows[0])), size_t> last;
    for (size_t i = 0; i < runs.rows.size(); ++i)
        last[keyOf(runs.rows[i])] = i;
    std::vector<RunRow> kept;
    for (size_t i = 0; i < runs.rows.size(); ++i)
        if (last[keyOf(runs.rows[i])] == i)
            kept.push_back(std::move(runs.rows[i]));
        else
            ++runs.replaced;
    runs.rows = std::move(kept);
    if (runs.replaced)
        runs.notes.push_back(formatString("left out %llu line%s that a later one replaces: the same run, measured "
                                          "again",
                                          static_cast<unsigned long long>(runs.replaced),
                                          runs.replaced == 1 ? "" : "s"));
}

} // namespace gsc
