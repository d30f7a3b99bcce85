// SPDX-License-Identifier: Apache-2.0
// The file that a shard writes a line to for every task it has done, and goes on from when it is started again.
#pragma once

#include "runtime/records/shard_facts.h"
#include "player/options/shard.h"
#include "runtime/records/row_file.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace gsc {

extern const RowKind kFrameRow;

// Facts that all rows of a shard's file share; `task` is 0.
ShardFacts shardFacts(const Shard& shard, uint64_t tasks, uint64_t model, uint64_t set);

// Throws Error(Usage) where a row is of another shard, plan, model or version of the program than `expected`.
void checkShardRow(const ShardFacts& row, const ShardFacts& expected, const std::string& path, const char* option);

class ShardRows {
public:
    // Reads the file, before any work; what a killed run left half-written goes with the next row. Throws Error:
    // InvalidFile for a line that is no row of a shard; Io;
    // Usage for rows of another shard.
    ShardRows(const std::string& path, const RowKind& kind, const Shard& shard);

    [[nodiscard]] bool isNew() const { return m_is_new; } // there was no such file
    [[nodiscard]] const std::string& cutOff() const { return m_file.cutOff(); }
    [[nodiscard]] const OrderedJson* find(uint64_t task) const;

    // Takes the facts of the shard. Throws Error(Usage) where the rows are not of it.
    void check(const ShardFacts& facts);
    // Behind check(): makes the file, so that a run that is killed before its first row is known as begun. Throws Error(Io).
    void begin();
    // Throws Error(Io), also where another program writes there too.
    void add(uint64_t task, std::string_view line);

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
