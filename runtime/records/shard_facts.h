// SPDX-License-Identifier: Apache-2.0
// A run can be split into shards. Each row that a shard writes ends with a field "shard", which says which shard of
// which run wrote it; gsc merge-runs takes that field away.
#pragma once

#include "runtime/records/record.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace gsc {

struct ShardFacts {
    uint64_t index = 0, count = 0; // from 1 to count
    uint64_t task = 0, tasks = 0;  // from 0, of all shards together
    std::string model;             // the file's checksum
    std::string set;               // hash of all that changes what the tasks give, and of this program's version

    bool operator==(const ShardFacts&) const = default;
};

// Written and read by the same lines.
void describe(const Record& at, ShardFacts& facts);

// A line that is an object, with the facts as its last field.
std::string withShard(std::string_view line, const ShardFacts& facts);

std::string hashText(uint64_t hash); // as ids of runs are written

} // namespace gsc
