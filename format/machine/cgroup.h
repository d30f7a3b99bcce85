// SPDX-License-Identifier: Apache-2.0
// Reads the limits of the control groups of this process, which a container, systemd (MemoryMax, TasksMax, CPUQuota) or
// a batch system sets. Knows versions 1 and 2, and counts the process's own group and all groups around it.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace gsc {

struct CgroupLimits {
    uint64_t memory = std::numeric_limits<uint64_t>::max(); // limit of memory in bytes
    uint64_t memory_free =
        // bytes left before the system kills the process; memory that only caches files counts as free
        std::numeric_limits<uint64_t>::max();
    uint64_t pids = std::numeric_limits<uint64_t>::max(); // limit of processes and threads together
    // limit of processors: 1.5 is the time of one and a half
    double processors = std::numeric_limits<double>::infinity();
};

// `root`: folder that takes the place of / in tests. A limit that cannot be read counts as no limit.
CgroupLimits cgroupLimits(const std::string& root = "");

} // namespace gsc
