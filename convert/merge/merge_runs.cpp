// SPDX-License-Identifier: Apache-2.0
#include "convert/merge/merge_runs.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"
#include "runtime/records/row_lines.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace gsc {

namespace {

constexpr const char* kFrames = "gsc.frame-stats/1";
// Limit for a hostile row: missing tasks are listed, and the list must not take all memory.
constexpr uint64_t kMostTasks = 10'000'000;
constexpr uint64_t kMostShards = 1'000'000; // most shards that gsc-play accepts

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

// Some numbers of a list, such as "3, 7 and 12 more".
std::string listOf(const std::vector<uint64_t>& numbers)
{
    constexpr size_t kShown = 5;
    std::string text;
    for (size_t i = 0; i < std::min(numbers.size(), kShown); ++i)
        text += (i > 0 ? ", " : "") + std::to_string(numbers[i]);
    return numbers.size() > kShown ? text + formatString(" and %zu more", numbers.size() - kShown) : text;
}

} // namespace

void RunMerger::addLine(std::string_view line, const std::string& where, bool has_end)
{
    OrderedJson json = parsedRow(line, where, has_end);
    std::string schema;
    Record(json, where, "gsc-play --shard").field("schema", schema, kName);
    const bool is_run = isRunSchema(schema, where);
    if (!is_run && schema != kFrames)
        throw Error(ErrorCode::Unsupported, where, formatString("schema is %.60s", schema.c_str()),
                    formatString("%s or %s", kFrames, kRunSchema), "use the gsc of the program that wrote it");
    if (!json.contains("shard"))
        throw Error(ErrorCode::InvalidFile, where, "has no shard", "a row that gsc-play wrote with --shard",
                    "leave this file out, it is of a run that was not split or is merged already");
    Row row;
    ShardFacts facts;
    const Record record(json, where, schema.c_str());
    describe(record.object("shard"), facts);
    record.object("shard").check("tasks", facts.tasks <= kMostTasks, "at most 10000000");
    record.object("shard").check("count", facts.count <= kMostShards, "at most 1000000");
    std::string form = schema;
    if (is_run) {
        const RunRow run = runRowOf(json, where);
        row.device = run.device.name;
        form = run.stability ? "rows of stability" : "rows of a sweep";
        row.exceeds = run.stability && !run.stability->passed();
        if (!run.stability)
            row.id = run.config.id; // no id for stability: it may list a trajectory twice
    } else {
        record.field("backend", row.device, kName);
    }
    if (m_rows.empty()) {
        m_schema = schema;
        m_form = form;
        m_model = facts.model;
        m_set = facts.set;
        m_count = facts.count;
        m_first = where;
        m_tasks = facts.tasks;
    }
    const char* const differs = form != m_form           ? "form"
                                : facts.model != m_model ? "model"
                                : facts.count != m_count ? "number of shards"
                                : facts.tasks != m_tasks ? "number of tasks"
                                : facts.set != m_set     ? "configuration or version of gsc-play"
                                                         : nullptr;
    if (differs != nullptr)
        throw Error(ErrorCode::InvalidFile, where, formatString("is of another %s than %s", differs, m_first.c_str()),
                    "rows of one run", "merge the files of each run by themselves");
    if (const auto found = m_rows.find(facts.task); found != m_rows.end())
        throw Error(ErrorCode::InvalidFile, where,
                    formatString("task %llu was in %s already", static_cast<unsigned long long>(facts.task),
                                 found->second.where.c_str()),
                    "each once", "leave one of the files out");
    row.where = where;
    row.shard = facts.index;
    json.erase("shard");
    row.line = jsonText(json, -1);
    m_rows.emplace(facts.task, std::move(row));
}

void RunMerger::add(std::string_view text, const std::string& path)
{
    forEachRow(text, path, [&](std::string_view line, const std::string& where) {
        addLine(line, where, line.data() + line.size() < text.data() + text.size());
    });
}

MergedRuns RunMerger::finish(bool allow_missing) const
{
    if (m_rows.empty())
        throw Error(ErrorCode::InvalidFile, "gsc merge-runs", "no row of a shard in any file", "at least one",
                    "gsc-play --shard writes them");
    MergedRuns merged{m_schema, "", m_count, m_tasks, 0, 0, {}, {}};
    std::set<uint64_t> shards;
    std::set<std::string_view> devices, ids;
    for (uint64_t task = 0; task < m_tasks; ++task)
        if (!m_rows.contains(task))
            merged.missing.push_back(task);
    for (const auto& [task, row] : m_rows) {
        shards.insert(row.shard);
        if (!row.id.empty() && !ids.insert(row.id).second)
            continue; // one run twice: a decode budget of "match" turned out equal to a number in the sweep's file
        merged.text += row.line + "\n";
        ++merged.rows;
        merged.exceeded += row.exceeds;
        if (devices.insert(row.device).second)
            merged.devices.push_back(row.device);
    }
    if (!merged.missing.empty() && !allow_missing) {
        std::vector<uint64_t> silent;
        for (uint64_t shard = 1; shard <= m_count && shards.size() < m_count; ++shard)
            if (!shards.contains(shard))
                silent.push_back(shard);
        throw Error(ErrorCode::InvalidFile, "gsc merge-runs",
                    formatString("%s of %s have no row: %s%s", formatCount(merged.missing.size()).c_str(),
                                 formatCount(m_tasks, "task").c_str(), listOf(merged.missing).c_str(),
                                 silent.empty() ? "" : (" (no row of shard " + listOf(silent) + ")").c_str()),
                    "all", "start the shards again that have not ended, or pass --allow-missing");
    }
    return merged;
}

} // namespace gsc
