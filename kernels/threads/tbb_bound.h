// SPDX-License-Identifier: Apache-2.0
// TBB ends the process, or hangs, where the system gives it no thread. All that uses TBB calls this first.
#pragma once

#include "format/machine/threads.h"

#include <oneapi/tbb/global_control.h>

namespace gsc {

// Keeps TBB from starting threads if threads are short: its loops then run on the threads that call them. Returns true
// if so. `threads` as for poolThreads().
inline bool boundTbb(int threads = 0)
{
    if (!threadsAreShort(threads))
        return false;
    // never destroyed: at the end of the program TBB would be free to start the threads it was denied
    static const auto* const none = new tbb::global_control(tbb::global_control::max_allowed_parallelism, 1);
    (void)none;
    return true;
}

} // namespace gsc
