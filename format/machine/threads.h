// SPDX-License-Identifier: Apache-2.0
// Starts threads where the system allows few: ulimit -u, TasksMax of systemd, the pids limit of a container. Code that
// can work with fewer threads asks how many it can have; code that cannot throws an Error that names these limits.
#pragma once

#include <gsc/error.h>

#include <cstddef>
#include <string>
#include <system_error>
#include <utility>

namespace gsc {

// Returns how many threads can be started now, at most `most`: it starts that many and lets them end, which takes
// microseconds for each.
size_t startableThreads(size_t most);

// Number of threads for a pool, its caller's included, of which `threads` are wanted (0 = all usable processors): that
// number if dozens are left for others, else at most half of those that can be started. Whether threads are few is
// found once per process.
int poolThreads(int threads);

// Returns true if a pool of `threads` (0 = all usable processors) would leave fewer than 32 for others. A library that
// ends the process when it gets no thread must then start none.
bool threadsAreShort(int threads);

// While an object of this class lives on a thread, code on that thread that cannot start as many threads as it wants
// continues with fewer. Without such an object the program may end (runtime/cli/thread_guard.h).
class ThreadAttempt {
public:
    ThreadAttempt() { ++count; }
    ~ThreadAttempt() { --count; }
    ThreadAttempt(const ThreadAttempt&) = delete;
    ThreadAttempt& operator=(const ThreadAttempt&) = delete;
    static bool isOn() { return count > 0; }

private:
    static inline thread_local int count = 0;
};

// Limits that apply to threads, for messages: "ulimit -u is 12, pids.max is 40".
std::string threadLimits();

// Makes an Error(OutOfMemory): `object` needs `count` threads that cannot be started.
Error tooFewThreads(const std::string& object, size_t count = 1);

// Throws tooFewThreads() if fewer than `count` threads can be started now.
void requireThreads(const std::string& object, size_t count);

// Starts a std::thread or std::jthread that runs `body`; throws tooFewThreads() if that fails.
template <typename Thread, typename Body>
Thread startThread(const char* object, Body&& body)
{
    const ThreadAttempt attempt;
    try {
        return Thread(std::forward<Body>(body));
    } catch (const std::system_error&) {
        throw tooFewThreads(object);
    }
}

} // namespace gsc
