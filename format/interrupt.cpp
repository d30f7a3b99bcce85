// SPDX-License-Identifier: Apache-2.0
#include <gsc/interrupt.h>

#include <gsc/error.h>

#include <atomic>
#include <csignal>

#include <signal.h>

namespace gsc {

namespace {

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free); // the only kind a signal handler may touch

constexpr int kRequests[] = {SIGINT, SIGTERM, SIGHUP};

// True if the process was started with the signal ignored (by nohup, or a shell's `command &`): it then ignores the
// signal.
bool ignored(int number)
{
    struct sigaction now {};
    return ::sigaction(number, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

extern "C" void onInterrupt(int)
{
    g_interrupted.store(true, std::memory_order_relaxed);
    // the next signal, of any kind that is not ignored, gets the default action
    for (const int number : kRequests)
        if (!ignored(number))
            std::signal(number, SIG_DFL);
}

} // namespace

void installInterruptHandler()
{
    struct sigaction action {};
    action.sa_handler = onInterrupt;
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART; // reads and writes in flight go on; the loops ask
    for (const int number : kRequests)
        if (!ignored(number))
            ::sigaction(number, &action, nullptr);
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
        throw Error(ErrorCode::Interrupted, "interrupted", "stopped early", "to run to the end",
                    "run it again (nothing was written)");
}

} // namespace gsc
