// SPDX-License-Identifier: Apache-2.0
// Threads where the system gives few: ulimit -u, TasksMax of systemd, the pids limit of a container. Code that can do
// with fewer threads asks how many there are; code that cannot throws an Error that names the limits.
#pragma once

#include <gsc/error.h>

#include <cstddef>
#include <string>
#include <system_error>
#include <utility>

namespace gsc {

// Number of threads that can be started now, at most `most`: starts that many and lets them end. Takes microseconds for
// each.
size_t startableThreads(size_t most);

// Threads of a pool that asks for `threads` (0 = all usable processors), the caller's among them: that number if it
// leaves dozens for others, else at most half of the threads that can be started. Computed once for a process.
int poolThreads(int threads);

// Does that leave fewer than dozens for others? A library that ends the process where it gets no thread must then start none.
bool threadsAreShort(int threads);

// While one lives on a thread, code there that starts threads continues with fewer if the system gives no more. Without
// it the program may end (runtime/cli/thread_guard.h).
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

// "ulimit -u is 12, pids.max is 40".
std::string threadLimits();

// Error(OutOfMemory): `object` needs `count` threads that cannot be started.
Error tooFewThreads(const std::string& object, size_t count = 1);

// Throws tooFewThreads() where fewer than `count` can be started.
void requireThreads(const std::string& object, size_t count);

// A std::thread or std::jthread that runs `body`; throws tooFewThreads().
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
