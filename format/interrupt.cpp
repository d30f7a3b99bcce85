// SPDX-License-Identifier: Apache-2.0
#include <gsc/interrupt.h>

#include <gsc/error.h>

#include <atomic>
#include <csignal>

#include <signal.h>

namespace gsc {

namespace {

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free); // a signal handler may touch no other kind of atomic

constexpr int kRequests[] = {SIGINT, SIGTERM, SIGHUP};

// Returns true if the process was started with this signal ignored (by nohup, or a shell's `command &`); it must then
// go on ignoring it.
bool ignored(int number)
{
    struct sigaction now {};
    return ::sigaction(number, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

extern "C" void onInterrupt(int)
{
    g_interrupted.store(true, std::memory_order_relaxed);
    // gives all these signals their default action, so that the next one ends the process
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
    action.sa_flags = SA_RESTART; // reads and writes under way are continued; the loops ask for the interrupt
    for (const int number : kRequests)
        if (!ignored(number))
            ::sigaction(number, &action, nullptr);
    // a closed pipe, or a file beyond the size limit, is then an error of the write, after which the program cleans up
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
