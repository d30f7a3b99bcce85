// SPDX-License-Identifier: Apache-2.0
#include "convert/merge/merge_runs.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "runtime/records/run_row.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace gsc {

namespace {

constexpr const char* kFrames = "gsc.frame-stats/1";
constexpr const char* kRuns = "gsc.run/1";
constexpr const char* kStability = "gsc.stability/1";
// A hostile row must not take all memory: what is missing is listed.
constexpr uint64_t kMostTasks = 10'000'000;
constexpr uint64_t kMostShards = 1'000'000; // the most that gsc-play takes

const FieldKind kWarnings = {[](const OrderedJson& v) { return v.is_array() && std::ranges::all_of(v, kText.fits); },
                             "an array of texts"};

OrderedJson parsedRow(std::string_view line, const std::string& where, bool has_end)
{
    ParsedRow row = parseRow(line);
    if (row.json.is_object())
        return std::move(row.json);
    if (row.state == ParsedRow::State::BeyondLimits)
        throw Error(ErrorCode::InvalidFile, where, row.fault, "a row as gsc-play --shard writes it", "remove the line");
    if (!has_end)
        throw Error(ErrorCode::InvalidFile, where, "is half-written, what a shard that was killed left behind",
                    "whole lines", "start that shard again, it goes on there");
    throw Error(ErrorCode::InvalidFile, where, "is no JSON object", "a row as gsc-play --shard writes it",
                "remove the line");
}

// Looks for what is wrong in a row besides its shard. Returns the device that it names; `id` becomes that of its run.
std::string checkRow(const Record& record, const char* schema, std::string& id)
{
    std::string name;
    if (schema == kFrames) {
        record.field("backend", name, kName);
        return name;
    }
    if (schema == kRuns) {
        RunRow row;
        describe(record, row);
        id = row.config.id;
        return row.device.name;
    }
    bool passed = false;
    OrderedJson paths, warnings;
    record.field("passed", passed, kFlag);
    record.field("trajectories", paths, kOneTrajectory);
    record.field("warnings", warnings, kWarnings);
    record.object("device").field("name", name, kText);
    return name;
}

// One report of all, in the words of a run that was not split: what is asked for at the end is that of the last.
// `exceeded` becomes the number of trajectories that exceed a bound.
std::string stabilityReport(const std::vector<std::string>& lines, uint64_t& exceeded)
{
    OrderedJson report = OrderedJson::parse(lines.back());
    OrderedJson paths = OrderedJson::array(), warnings = OrderedJson::array();
    std::set<std::string> told;
    exceeded = 0;
    for (const std::string& line : lines) {
        const OrderedJson row = OrderedJson::parse(line);
        paths.push_back(row["trajectories"][0]);
        exceeded += row["passed"].get<bool>() ? 0 : 1;
        for (const OrderedJson& warning : row["warnings"])
            if (told.insert(warning.get<std::string>()).second)
                warnings.push_back(warning);
    }
    report["trajectories"] = std::move(paths);
    report["passed"] = exceeded == 0;
    report["warnings"] = std::move(warnings);
    return jsonText(report, 2) + "\n";
}

// "3, 7 and 12 more"
std::string listOf(const std::vector<uint64_t>& numbers)
{
    constexpr size_t kShown = 5;
    std::string text;
    for (size_t i = 0; i < std::min(numbers.size(), kShown); ++i)
        text += (i > 0 ? ", " : "") + std::to_string(numbers[i]);
    return numbers.size() > kShown ? text + formatString(" and %zu more", numbers.size() - kShown) : text;
}

} // namespace

void RunMerger::addLine(std::string_view line, const std::string& where)
{
    const bool has_end = line.ends_with('\n');
    OrderedJson json = parsedRow(line, where, has_end);
    std::string stated;
    Record(json, where, "gsc-play --shard").field("schema", stated, kName);
    const char* const known[] = {kFrames, kRuns, kStability};
    const char* const* const found = std::ranges::find(known, stated);
    if (found == std::end(known))
        throw Error(ErrorCode::Unsupported, where, formatString("schema is %.60s", stated.c_str()),
                    formatString("%s, %s or %s", kFrames, kRuns, kStability),
                    "use the gsc of the program that wrote it");
    const char* const schema = *found;
    const Record record(json, where, schema);
    if (!json.contains("shard"))
        throw Error(ErrorCode::InvalidFile, where, "has no shard", "a row that gsc-play wrote with --shard",
                    "leave this file out, it is of a run that was not split or is merged already");
    ShardFacts facts;
    describe(record.object("shard"), facts);
    record.object("shard").check("tasks", facts.tasks <= kMostTasks, "at most 10000000");
    record.object("shard").check("count", facts.count <= kMostShards, "at most 1000000");
    std::string id;
    std::string device = checkRow(record, schema, id);
    if (m_rows.empty()) {
        m_schema = schema;
        m_model = facts.model;
        m_set = facts.set;
        m_count = facts.count;
        m_first = where;
        m_tasks = facts.tasks;
    }
    const char* const differs = schema != m_schema       ? "form"
                                : facts.model != m_model ? "model"
                                : facts.count != m_count ? "number of shards"
                                : facts.tasks != m_tasks ? "number of tasks"
                                : facts.set != m_set     ? "configuration or version of gsc-play"
                                                         : nullptr;
    if (differs != nullptr)
        throw Error(ErrorCode::InvalidFile, where, formatString("is of another %s than %s", differs, m_first.c_str()),
                    "rows of one run", "merge the files of each run by themselves");
    const auto [place, is_new] = m_rows.try_emplace(facts.task);
    Row& row = place->second;
    if (!is_new)
        throw Error(
            ErrorCode::InvalidFile, where,
            formatString("task %llu was in %s already", static_cast<unsigned long long>(facts.task), row.where.c_str()),
            "each once", "leave one of the files out");
    row.where = where;
    row.shard = facts.index;
    row.device = std::move(device);
    row.id = std::move(id);
    json.erase("shard");
    row.line = jsonText(json, -1);
}

void RunMerger::add(std::string_view text, const std::string& path)
{
    for (size_t at = 0, number = 1; at < text.size(); ++number) {
        throwIfInterrupted();
        const size_t end = text.find('\n', at);
        const size_t next = end == text.npos ? text.size() : end + 1;
        addLine(text.substr(at, next - at), formatString("%s:%zu", path.c_str(), number));
        at = next;
    }
}

MergedRuns RunMerger::finish(bool allow_missing) const
{
    if (m_rows.empty())
        throw Error(ErrorCode::InvalidFile, "gsc merge-runs", "no row of a shard in any file", "at least one",
                    "gsc-play --shard writes them");
    MergedRuns merged{m_schema, "", m_count, m_tasks, 0, 0, {}, {}};
    std::vector<std::string> lines;
    std::set<uint64_t> shards;
    std::set<std::string_view> devices, ids;
    for (uint64_t task = 0; task < m_tasks; ++task)
        if (!m_rows.contains(task))
            merged.missing.push_back(task);
    for (const auto& [task, row] : m_rows) {
        shards.insert(row.shard);
        if (!row.id.empty() && !ids.insert(row.id).second)
            continue; // a decode budget of "match" that is the same as one that the sweep states: one run, once
        lines.push_back(row.line);
        if (devices.insert(row.device).second)
            merged.devices.push_back(row.device);
    }
    merged.rows = lines.size();
    if (!merged.missing.empty() && !allow_missing) {
        std::vector<uint64_t> silent;
        for (uint64_t shard = 1; shard <= m_count && shards.size() < m_count; ++shard)
            if (!shards.contains(shard))
                silent.push_back(shard);
        throw Error(ErrorCode::InvalidFile, "gsc merge-runs",
                    formatString("%zu of %llu tasks have no row: %s%s", merged.missing.size(),
                                 static_cast<unsigned long long>(m_tasks), listOf(merged.missing).c_str(),
                                 silent.empty() ? "" : (" (no row of shard " + listOf(silent) + ")").c_str()),
                    "all", "start the shards again that have not ended, or pass --allow-missing");
    }
    if (m_schema == kStability)
        merged.text = stabilityReport(lines, merged.exceeded);
    else
        for (const std::string& line : lines)
            merged.text += line + "\n";
    return merged;
}

} // namespace gsc
