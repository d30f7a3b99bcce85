// SPDX-License-Identifier: Apache-2.0
// A run can be split into shards. Each row that a shard writes ends with a field "shard", which names the shard and
// the run; gsc merge-runs removes the field.
#pragma once

#include "runtime/records/record.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace gsc {

struct ShardFacts {
    uint64_t index = 0, count = 0; // shard, from 1 to count
    uint64_t task = 0, tasks = 0;  // task, from 0, and tasks of all shards together
    std::string model;             // checksum of the model's file
    std::string set;               // hash of everything that changes a task's result, with the program's version

    bool operator==(const ShardFacts&) const = default;
};

// Writes or reads the facts, as `at` does.
void describe(const Record& at, ShardFacts& facts);

// `line`, an object, with the facts added as its last field "shard".
std::string withShard(std::string_view line, const ShardFacts& facts);

std::string hashText(uint64_t hash); // hexadecimal, as in ids of runs

} // namespace gsc
