// SPDX-License-Identifier: Apache-2.0
// Threads that wait for a job and take ranges of it by a counter. Works with as many threads as the system gives.
#pragma once

#include "format/machine/threads.h"
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace gsc {

// Number of times that a thread looks for work before it sleeps: tens of microseconds, which is the gap between two
// stages of a frame, and the time that waking takes.
inline constexpr int kLooks = 500;

inline void pauseBriefly()
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

template <typename Condition>
void lookFor(Condition&& condition)
{
    for (int i = 0; i < kLooks && !condition(); ++i)
        pauseBriefly();
}

class PlainPool {
public:
    explicit PlainPool(int threads) // `threads`: number of threads, with that of the caller
    {
        m_threads.reserve(size_t(threads) - 1);
        const ThreadAttempt attempt;
        try {
            for (int worker = 1; worker < threads; ++worker)
                m_threads.emplace_back([this, worker] { help(worker); });
        } catch (const std::system_error&) {
            // the system gives no more threads; those already started do all of the work
        }
    }

    ~PlainPool()
    {
        {
            const std::lock_guard lock(m_mutex);
            m_stop = true;
            ++m_posts;
        }
        m_posted.notify_all();
        for (std::thread& thread : m_threads)
            thread.join();
    }

    // Runs a job as Workers::run() says. Precondition: count > 0.
    void run(size_t count, size_t grain, const Workers::Body& body)
    {
        grain = std::max<size_t>(1, grain);
        Job job{count, grain, (count - 1) / grain + 1, body};
        run(job);
        if (job.error)
            std::rethrow_exception(job.error);
    }

private:
    struct Job {
        size_t count, grain, ranges;
        const Workers::Body& body;
        std::atomic<size_t> next{0};
        std::atomic<bool> failed{false};
        std::exception_ptr error{}; // exception of the body that failed first
    };

    void run(Job& job)
    {
        const std::lock_guard one_job(m_callers);
        {
            const std::lock_guard lock(m_mutex);
            m_job = &job;
            ++m_posts;
        }
        if (job.ranges > m_threads.size())
            m_posted.notify_all();
        else
            for (size_t i = 1; i < job.ranges; ++i)
                m_posted.notify_one();
        work(job, 0);

        std::unique_lock lock(m_mutex);
        m_job = nullptr; // from here on no thread joins the job; it may be destroyed when the last thread has left it
        lock.unlock();
        lookFor([this] { return m_helping == 0; });
        lock.lock();
        m_left.wait(lock, [this] { return m_helping == 0; });
    }

    static void work(Job& job, int worker)
    {
        try {
            for (size_t range = job.next++; range < job.ranges; range = job.next++) {
                const size_t begin = range * job.grain;
                job.body(begin, std::min(job.count, begin + job.grain), worker);
            }
        } catch (...) {
            job.next = job.ranges;
            if (!job.failed.exchange(true))
                job.error = std::current_exception();
        }
    }

    void help(int worker)
    {
        uint32_t seen = 0;
        for (;;) {
            lookFor([&] { return m_posts != seen; });
            std::unique_lock lock(m_mutex);
            m_posted.wait(lock, [&] { return m_posts != seen; });
            if (m_stop)
                return;
            seen = m_posts;
            if (m_job == nullptr)
                continue; // the job has ended already
            Job& job = *m_job;
            ++m_helping;
            lock.unlock();
            work(job, worker);
            lock.lock();
            if (--m_helping == 0)
                m_left.notify_one();
        }
    }

    std::mutex m_callers; // locked by the thread whose job is under way
    std::mutex m_mutex;   // locked while the members below are read or written
    std::condition_variable m_posted, m_left;
    std::atomic<uint32_t> m_posts{0};
    std::atomic<uint32_t> m_helping{0}; // number of threads at work on the job, without its caller
    Job* m_job = nullptr;
    bool m_stop = false;
    std::vector<std::thread> m_threads;
};

} // namespace gsc
