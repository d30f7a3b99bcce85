// SPDX-License-Identifier: Apache-2.0
// Tasks of a run that this process does: --shard. Every shard makes the same plan and takes its own part of it, so
// none has to know of the others.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace gsc {

struct Shard {
    uint64_t index = 0, count = 0; // from 1 to count; 0 of 0 = the run is not split

    [[nodiscard]] bool isGiven() const { return count > 0; }
    [[nodiscard]] std::string text() const; // "2/4"
};

// A variable's text, null where it is not set.
using Environment = std::function<const char*(const char* name)>;
const char* processEnvironment(const char* name);

// "2/4"; "auto": from the variables of Slurm's job arrays or Open MPI; "auto/4": from those or the index of a
// Kubernetes job, which does not tell its pods how many they are. Throws Error(Usage).
// ranks_are_devices: this program runs once for all ranks of Open MPI, whose numbers then say nothing of parts.
Shard parseShard(const std::string& text, const std::string& option, const Environment& environment,
                 bool ranks_are_devices = false);

// True if the shard does task `task`, counted from 0. Deals tasks to shards in turn: for tasks of equal cost that share
// nothing.
bool takesTask(const Shard& shard, uint64_t task);

// Shard of each task, from 0, in blocks of about equal weight: for tasks that cost less side by side.
std::vector<uint64_t> blockShards(const std::vector<uint64_t>& weights, uint64_t count);

} // namespace gsc
