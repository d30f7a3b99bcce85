// SPDX-License-Identifier: Apache-2.0
// Runs work on the parts of an archive on several threads. The thread pools (Workers) are in kernels/, which format/
// may not use.
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

// Starts `count` items of work, numbered from 0, on several threads: calls make() once on each thread, then the
// function that it returned with one number after another, which ascend on each thread. The first exception is thrown
// to the caller; no further number is begun after it.
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
            // the system gives no more threads; those already started do all of the work
        }
        work();
    }
    if (error)
        std::rethrow_exception(error);
}

} // namespace gsc
