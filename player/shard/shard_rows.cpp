// SPDX-License-Identifier: Apache-2.0
#include "player/shard/shard_rows.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "format/numbers/count_text.h"

#include <filesystem>

namespace gsc {

const RowKind kFrameRow{R"({"schema":"gsc.frame-stats/1",)", "gsc-play --shard",
                        "\"gsc.frame-stats/1\" with a shard (schemas/frame-stats.schema.json)", "--stats"};
ShardFacts shardFacts(const Shard& shard, uint64_t tasks, uint64_t model, uint64_t set)
{
    return {shard.index, shard.count, 0, tasks, hashText(model), hashText(set)};
}

void checkShardRow(const ShardFacts& row, const ShardFacts& expected, const std::string& path, const char* option)
{
    const auto number = [](uint64_t value) { return static_cast<unsigned long long>(value); };
    std::string is;
    if (row.index != expected.index || row.count != expected.count)
        is = formatString("shard %llu/%llu", number(row.index), number(row.count));
    else if (row.model != expected.model)
        is = "another model";
    else if (row.tasks != expected.tasks)
        is = "a run of " + formatCount(row.tasks, "task");
    else if (row.set != expected.set)
        is = "other options, cameras or another version of gsc-play";
    if (!is.empty())
        throw Error(ErrorCode::Usage, path, "has rows of " + is,
                    formatString("those of shard %llu/%llu of this run of %s", number(expected.index),
                                 number(expected.count), formatCount(expected.tasks, "task").c_str()),
                    formatString("give every shard of every run its own %s", option));
}

ShardRows::ShardRows(const std::string& path, const RowKind& kind, const Shard& shard, const char* part)
    : m_file(path, kind, [&](const OrderedJson& json, const std::string& where) {
          Row row;
          const Record record(json, where, kind.expected);
          describe(record.object("shard"), row.facts);
          if (part != nullptr && !record.hasPart(part, true))
              throw Error(ErrorCode::InvalidFile, where, std::string("has no ") + part, kind.expected,
                          "remove the line or run it again");
          row.json = json;
          const uint64_t task = row.facts.task;
          if (!m_rows.try_emplace(task, std::move(row)).second)
              throw Error(ErrorCode::InvalidFile, where,
                          formatString("has task %llu, which a line above has", static_cast<unsigned long long>(task)),
                          "each task once", "remove one of the lines");
      })
{
    for (const auto& [task, row] : m_rows) {
        ShardFacts expected = row.facts;
        expected.index = shard.index;
        expected.count = shard.count;
        checkShardRow(row.facts, expected, path, kind.option);
    }
    std::error_code code;
    m_is_new = !std::filesystem::exists(path, code);
}

const OrderedJson* ShardRows::find(uint64_t task) const
{
    const auto found = m_rows.find(task);
    return found == m_rows.end() ? nullptr : &found->second.json;
}

void ShardRows::check(const ShardFacts& facts)
{
    m_facts = facts;
    for (const auto& [task, row] : m_rows)
        checkShardRow(row.facts, facts, m_file.path(), m_file.kind().option);
}

void ShardRows::begin()
{
    if (m_is_new)
        writeTextFile(m_file.path(), "", false);
}

void ShardRows::add(uint64_t task, std::string_view line)
{
    m_file.add(withShard(line, factsOf(task)));
}

ShardFacts ShardRows::factsOf(uint64_t task) const
{
    ShardFacts facts = m_facts;
    facts.task = task;
    return facts;
}

} // namespace gsc
