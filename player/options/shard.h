// SPDX-License-Identifier: Apache-2.0
// The part of a run's tasks that this process does: --shard. Every process makes the same plan and does its own part
// of it, so that none needs to know of the others.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace gsc {

struct Shard {
    uint64_t index = 0, count = 0; // index: 1 to count; both 0 = the run is not split

    [[nodiscard]] bool isGiven() const { return count > 0; }
    [[nodiscard]] std::string text() const; // returns index and count as "2/4"
};

// Returns the text of an environment variable, null if it is not set.
using Environment = std::function<const char*(const char* name)>;
const char* processEnvironment(const char* name);

// Parses the value of --shard. "2/4": the second of four. "auto": from the variables of Slurm's job arrays or Open
// MPI. "auto/4": from those or from the index of a Kubernetes job, which does not tell its pods how many they are.
// `ranks_are_devices`: this program runs once for all ranks of Open MPI, so rank numbers do not choose a part. Throws
// Error(Usage).
Shard parseShard(const std::string& text, const std::string& option, const Environment& environment,
                 bool ranks_are_devices = false);

// Returns true if the shard does task `task`, counted from 0. Deals tasks to shards in turn: for tasks of equal cost
// that share nothing.
bool takesTask(const Shard& shard, uint64_t task);

// Returns the shard of each task, counted from 0. Each shard gets a block of consecutive tasks, of about equal total
// weight: for neighbouring tasks that share work.
std::vector<uint64_t> blockShards(const std::vector<uint64_t>& weights, uint64_t count);

} // namespace gsc
