// SPDX-License-Identifier: Apache-2.0
// Work on the parts of an archive, one after another on several threads. The layers above have pools (Workers); this one
// has no layer below.
#pragma once

#include "format/machine/threads.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace gsc {

[[nodiscard]] inline size_t partThreads(size_t count, int threads)
{
    return std::min(size_t(poolThreads(threads)), std::max<size_t>(1, count));
}

// Calls make() on each thread, and the function it returns with each number in [0, count), ascending per thread. The
// first exception reaches the caller, and no number is begun after it.
template <typename Make>
void onPartThreads(size_t count, int threads, const Make& make)
{
    std::atomic<size_t> next{0};
    std::atomic<bool> failed{false};
    std::mutex mutex;
    std::exception_ptr error;
    const auto work = [&] {
        try {
            auto body = make();
            for (size_t i; !failed && (i = next++) < count;)
                body(i);
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!failed.exchange(true))
                error = std::current_exception();
        }
    };
    {
        std::vector<std::jthread> others;
        const ThreadAttempt attempt;
        try {
            for (size_t i = 1; i < partThreads(count, threads); ++i)
                others.emplace_back(work);
        } catch (const std::system_error&) {
            // the system has no more threads; those there are do all of the work
        }
        work();
    }
    if (error)
        std::rethrow_exception(error);
}

} // namespace gsc
