// SPDX-License-Identifier: Apache-2.0
#include "format/interrupt.h"

#include "format/error.h"

#include <atomic>
#include <csignal>

#include <signal.h>

namespace gsc {

namespace {

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free); // the only kind a signal handler may touch

extern "C" void onInterrupt(int)
{
    g_interrupted.store(true, std::memory_order_relaxed);
    // the next signal, of either kind, gets the default action
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

} // namespace

void installInterruptHandler()
{
    struct sigaction action {};
    action.sa_handler = onInterrupt;
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART; // reads and writes in flight go on; the loops ask
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() noexcept
{
    return g_interrupted.load(std::memory_order_relaxed);
}

void throwIfInterrupted()
{
    if (interrupted())
        throw Error(ErrorCode::Interrupted, "interrupted: stopped before the end, nothing was written");
}

} // namespace gsc
