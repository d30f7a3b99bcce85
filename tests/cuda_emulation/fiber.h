// SPDX-License-Identifier: Apache-2.0
// Fibers: stacks that a thread of the operating system runs in turn. A switch saves the registers a call preserves and
// nothing else, so it costs nanoseconds.
#pragma once

#include <cstddef>

namespace gsc_emulation {

struct Fiber {
    void* stack_pointer = nullptr; // while it does not run
    const void* bottom = nullptr;  // bottom of its stack, for AddressSanitizer
    size_t bytes = 0;
    void* fake_stack = nullptr; // AddressSanitizer's
};

// A fiber that calls `entry` when it is first switched to. `entry` must begin with enterFiber() and never return. The
// stack is never given back.
Fiber makeFiber(void (*entry)());
void enterFiber();

// The stack that the caller runs on, as a fiber to come back to.
Fiber callersFiber();

// Returns when something switches back to `from`.
void switchFiber(Fiber& from, const Fiber& to);

} // namespace gsc_emulation
