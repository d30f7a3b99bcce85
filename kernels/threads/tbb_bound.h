// SPDX-License-Identifier: Apache-2.0
// Guards against TBB, which ends the process, or hangs, if the system gives it no thread. All code that uses TBB calls
// boundTbb() first.
#pragma once

#include "format/machine/threads.h"

#include <oneapi/tbb/global_control.h>

namespace gsc {

// Keeps TBB from starting threads if threads are short: its loops then run on the threads that call them. Returns true
// in that case. `threads`: as for poolThreads().
inline bool boundTbb(int threads = 0)
{
    if (!threadsAreShort(threads))
        return false;
    // never destroyed, since at the end of the program TBB would then start the threads that it was denied
    static const auto* const none = new tbb::global_control(tbb::global_control::max_allowed_parallelism, 1);
    (void)none;
    return true;
}

} // namespace gsc
