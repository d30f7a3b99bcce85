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
    // the next signal, of any kind, gets the default action
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
    std::signal(SIGHUP, SIG_DFL);
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
    struct sigaction hangup {};
    if (::sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) // nohup stays in force
        ::sigaction(SIGHUP, &action, nullptr);
    // a closed pipe and the file size limit become errors of the write, which clean up
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() noexcept
{
    return g_interrupted.load(std::memory_order_relaxed);
}

void throwIfInterrupted()
{
    if (interrupted())
        throw Error(ErrorCode::Interrupted,
                    "interrupted: stopped early, expected to run to the end; run it again (nothing was written)");
}

} // namespace gsc
