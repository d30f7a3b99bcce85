// SPDX-License-Identifier: Apache-2.0
// What the control groups of this process allow it: a container's limits, systemd's (MemoryMax, TasksMax, CPUQuota), a batch
// system's. Of version 1 and 2, of the group itself and of those around it.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace gsc {

struct CgroupLimits {
    uint64_t memory = std::numeric_limits<uint64_t>::max(); // bytes
    uint64_t memory_free =
        std::numeric_limits<uint64_t>::max();             // before the system kills; without what is used but for files
    uint64_t pids = std::numeric_limits<uint64_t>::max(); // processes and threads together
    double processors = std::numeric_limits<double>::infinity(); // of time: 1.5 is one and a half
};

// `root` is a folder that stands for / (tests). What cannot be read limits nothing.
CgroupLimits cgroupLimits(const std::string& root = "");

} // namespace gsc
