// SPDX-License-Identifier: Apache-2.0
// Limits of the control groups of this process: a container's, systemd's (MemoryMax, TasksMax, CPUQuota), a batch
// system's. Reads version 1 and 2, the process's own group and those around it.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace gsc {

struct CgroupLimits {
    uint64_t memory = std::numeric_limits<uint64_t>::max(); // bytes
    uint64_t memory_free =
        // left before the system kills the process; memory that only caches files counts as free
        std::numeric_limits<uint64_t>::max();
    uint64_t pids = std::numeric_limits<uint64_t>::max();        // processes and threads together
    double processors = std::numeric_limits<double>::infinity(); // CPU time per time: 1.5 is one and a half processors
};

// `root` is a folder that stands for / (tests). A limit that cannot be read counts as none.
CgroupLimits cgroupLimits(const std::string& root = "");

} // namespace gsc
