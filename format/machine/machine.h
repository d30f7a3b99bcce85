// SPDX-License-Identifier: Apache-2.0
// How much of the machine this process may use. All that asks for "all cores" or "half of the memory" asks here.
#pragma once

#include <cstdint>

namespace gsc {

// Bytes: the machine's memory, or less where a control group allows less; 0 = unknown.
uint64_t usableMemory();

// Where a control group allows less memory than the machine has, the system kills a program that takes more. From now on
// such a program gets none instead: std::bad_alloc. Where a GPU's driver is, nothing is changed: it reserves far more than
// it takes.
void boundMemory();

// Gives a child the limit that this process was started with.
void restoreLimits(int process);

// 1 or more: the processors that this process may run on, or fewer where a control group allows less of their time.
int usableProcessors();

} // namespace gsc
