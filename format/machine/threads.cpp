// SPDX-License-Identifier: Apache-2.0
#include "format/machine/threads.h"

#include "format/machine/cgroup.h"
#include "format/machine/machine.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include <pthread.h>
#include <sys/resource.h>

namespace gsc {

namespace {

constexpr size_t kRoom = 32; // threads that must remain for code which starts threads without asking
// threads left for libraries that start some when they are loaded, and for single threads
constexpr size_t kReserve = 8;

size_t threadsOfProcess()
{
    std::error_code none; // set if there is no /proc; the function then returns 0
    const std::filesystem::directory_iterator tasks("/proc/self/task", none);
    return none ? 0 : size_t(std::distance(begin(tasks), end(tasks)));
}

// Waits, at most 20 ms, until this process has no more than `threads` threads: one joined still counts for a moment.
void waitUntilGone(size_t threads)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
    while (threadsOfProcess() > threads && std::chrono::steady_clock::now() < end)
        std::this_thread::yield();
}

void* waitForTurn(void* turn)
{
    const std::lock_guard lock(*static_cast<std::mutex*>(turn));
    return nullptr;
}

// Result of startableThreads(), kept for later calls: at least `most` threads were free; if fewer than asked for,
// `found`.
struct Room {
    std::mutex mutex;
    size_t most = 0, found = std::numeric_limits<size_t>::max();

    size_t ask(size_t wanted)
    {
        const std::lock_guard lock(mutex);
        if (found == std::numeric_limits<size_t>::max() && wanted > most) {
            most = wanted;
            if (const size_t free = startableThreads(wanted); free < wanted)
                found = free;
        }
        return std::min(found, wanted);
    }
};

size_t roomFor(int threads)
{
    static Room room;
    return room.ask(size_t(threads) - 1 + kRoom);
}

std::string textOf(rlim_t limit)
{
    return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit);
}

} // namespace

size_t startableThreads(size_t most)
{
    const ThreadAttempt attempt;
    const size_t before = threadsOfProcess();
    std::mutex turn; // held until all threads have started, so that they end together
    std::vector<pthread_t> started;
    {
        const std::lock_guard lock(turn);
        started.reserve(most);
        pthread_t thread;
        while (started.size() < most && pthread_create(&thread, nullptr, waitForTurn, &turn) == 0)
            started.push_back(thread);
    }
    for (const pthread_t thread : started)
        pthread_join(thread, nullptr);
    waitUntilGone(before);
    return started.size();
}

int poolThreads(int threads)
{
    const int wanted = threads > 0 ? threads : usableProcessors();
    if (wanted == 1 || !threadsAreShort(wanted))
        return wanted;
    const size_t room = roomFor(wanted);
    return 1 + int(std::min(size_t(wanted) - 1, room > kReserve ? (room - kReserve) / 2 : 0));
}

bool threadsAreShort(int threads)
{
    const int wanted = threads > 0 ? threads : usableProcessors();
    return roomFor(wanted) < size_t(wanted) - 1 + kRoom;
}

std::string threadLimits()
{
    std::string text;
    rlimit limit{};
    if (getrlimit(RLIMIT_NPROC, &limit) == 0)
        text += "ulimit -u is " + textOf(limit.rlim_cur) + ", ";
    // a limit of address space counts too, since stacks lie in it
    if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        text += "ulimit -v is " + textOf(limit.rlim_cur / 1024) + ", ";
    if (getrlimit(RLIMIT_DATA, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        text += "memory for stacks and all else is " + std::to_string(limit.rlim_cur >> 20) + " MiB, ";
    const uint64_t pids = cgroupLimits().pids;
    return text + "pids.max is " + (pids == std::numeric_limits<uint64_t>::max() ? "max" : std::to_string(pids));
}

Error tooFewThreads(const std::string& object, size_t count)
{
    return {ErrorCode::OutOfMemory, object, "too few threads can be started (" + threadLimits() + ")",
            std::to_string(count), "raise that limit, or end other programs of this user or container"};
}

void requireThreads(const std::string& object, size_t count)
{
    if (startableThreads(count) < count)
        throw tooFewThreads(object, count);
}

} // namespace gsc
