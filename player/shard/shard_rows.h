// SPDX-License-Identifier: Apache-2.0
// The file to which a shard adds a row for every task that is done; a shard that is started again continues there.
#pragma once

#include "runtime/records/shard_facts.h"
#include "player/options/shard.h"
#include "runtime/records/row_file.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace gsc {

extern const RowKind kFrameRow; // rows of frames, in --stats

// Facts shared by all rows of a shard; `task` is 0. `model`, `set`: hashes, see ShardFacts.
ShardFacts shardFacts(const Shard& shard, uint64_t tasks, uint64_t model, uint64_t set);

// Throws Error(Usage) if a row is of another shard, number of shards, model, run or version of the program than `expected`.
void checkShardRow(const ShardFacts& row, const ShardFacts& expected, const std::string& path, const char* option);

// Rows of a shard, by task.
class ShardRows {
public:
    // Reads the file, before any work; the next row replaces a half-written last one. `part`: a field that every row must
    // have. Throws Error: InvalidFile for a line that is no row of a shard, or a task that is there twice; Io; Usage for rows
    // of another shard.
    ShardRows(const std::string& path, const RowKind& kind, const Shard& shard, const char* part = nullptr);

    [[nodiscard]] bool isNew() const { return m_is_new; } // true if there was no such file
    [[nodiscard]] const std::string& cutOff() const { return m_file.cutOff(); }
    [[nodiscard]] const OrderedJson* find(uint64_t task) const;

    // Sets the facts for new rows. Throws Error(Usage) if the rows of the file are of another shard.
    void check(const ShardFacts& facts);
    // Makes the file, after check(), so that it shows that the shard has begun, even without a row. Throws Error(Io).
    void begin();
    // Adds the row of a task. Throws Error(Io), also if another program writes to the file.
    void add(uint64_t task, std::string_view line);

    [[nodiscard]] ShardFacts factsOf(uint64_t task) const; // facts in the row of a task

private:
    struct Row {
        ShardFacts facts;
        OrderedJson json;
    };
    std::map<uint64_t, Row> m_rows;
    RowFile m_file;
    ShardFacts m_facts;
    bool m_is_new = false;
};

} // namespace gsc
