// SPDX-License-Identifier: Apache-2.0
// Tells how much of the machine this process may use; "all cores" and "half of the memory" are computed from these
// numbers everywhere.
#pragma once

#include <cstdint>

namespace gsc {

// Bytes of memory: the machine's, or less if a control group allows less; 0 = unknown.
uint64_t usableMemory();

// Limits this process to the memory that a control group allows, if that is less than the machine's. Allocations beyond
// it then throw std::bad_alloc, where otherwise the system would kill the process. Does nothing on a machine with a GPU
// driver, which reserves far more memory than it takes.
void boundMemory();

// Gives the child process with number `process` the memory limit that this process was started with.
void restoreLimits(int process);

// Number of processors that this process may use, 1 or more; fewer than the machine's if its affinity or a control
// group says so.
int usableProcessors();

} // namespace gsc
