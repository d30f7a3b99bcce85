// SPDX-License-Identifier: Apache-2.0
// TBB ends the process, or hangs, where the system gives it no thread. All that uses TBB calls this first.
#pragma once

#include "format/machine/threads.h"

#include <oneapi/tbb/global_control.h>

namespace gsc {

// Where threads are short TBB starts none from here on: its loops then run on the threads that call them. Says whether
// that is so. `threads` as for poolThreads().
inline bool boundTbb(int threads = 0)
{
    if (!threadsAreShort(threads))
        return false;
    // never destroyed: at the end of the program it would let TBB start what it was kept from
    static const auto* const none = new tbb::global_control(tbb::global_control::max_allowed_parallelism, 1);
    (void)none;
    return true;
}

} // namespace gsc
