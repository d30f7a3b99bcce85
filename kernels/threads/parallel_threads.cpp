// SPDX-License-Identifier: Apache-2.0
// Workers without TBB, for a player that is one file: threads that wait for a job, and ranges handed out by a counter.
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>
#endif

namespace gsc {

namespace {

// how often a thread looks before it sleeps: tens of microseconds, the gap between two stages of a frame; waking a
// sleeper takes as long
constexpr int kLooks = 500;

void pauseBriefly()
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

// as TBB counts: the processors that this process may use
int usableProcessors()
{
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return std::max(1, CPU_COUNT(&set));
#endif
    return std::max(1, int(std::thread::hardware_concurrency()));
}

// The bodies that a thread is in, innermost first, and behind them those its job was posted from: run() inside a body
// of the same Workers must not wait for itself, nor where the body reached it through other Workers.
struct Frame {
    const void* pool;
    int worker;
    const Frame* outer;
};
thread_local const Frame* t_frame = nullptr;

} // namespace

struct Workers::Impl {
    struct Job {
        size_t count, grain, ranges;
        void* context;
        Erased body;
        const Frame* posted_from;
        std::atomic<size_t> next{0};
        std::atomic<bool> failed{false};
        std::exception_ptr error{}; // of the body that failed first
    };

    explicit Impl(int threads)
    {
        m_threads.reserve(size_t(threads) - 1);
        try {
            for (int worker = 1; worker < threads; ++worker)
                m_threads.emplace_back([this, worker] { help(worker); });
        } catch (const std::system_error&) {
            // the system has no more threads; those there are do all of the work
        }
    }

    ~Impl()
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

    // the worker that this thread is, -1 outside any body
    [[nodiscard]] int workerHere() const
    {
        for (const Frame* frame = t_frame; frame != nullptr; frame = frame->outer)
            if (frame->pool == this)
                return frame->worker;
        return -1;
    }

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
        m_job = nullptr; // nobody joins from here on, so the job may go when the last has left
        lock.unlock();
        lookFor([this] { return m_helping == 0; });
        lock.lock();
        m_left.wait(lock, [this] { return m_helping == 0; });
    }

    void work(Job& job, int worker) const
    {
        const Frame* const before = t_frame;
        const Frame frame{this, worker, job.posted_from};
        t_frame = &frame;
        try {
            for (size_t range = job.next++; range < job.ranges; range = job.next++) {
                const size_t begin = range * job.grain;
                job.body(job.context, begin, std::min(job.count, begin + job.grain), worker);
            }
        } catch (...) {
            job.next = job.ranges;
            if (!job.failed.exchange(true))
                job.error = std::current_exception();
        }
        t_frame = before;
    }

private:
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
                continue; // woke too late
            Job& job = *m_job;
            ++m_helping;
            lock.unlock();
            work(job, worker);
            lock.lock();
            if (--m_helping == 0)
                m_left.notify_one();
        }
    }

    std::mutex m_callers; // held by the thread whose job is posted
    std::mutex m_mutex;   // what is below changes only under it
    std::condition_variable m_posted, m_left;
    std::atomic<uint32_t> m_posts{0};
    std::atomic<uint32_t> m_helping{0}; // threads inside the job, beside its caller
    Job* m_job = nullptr;
    bool m_stop = false;
    std::vector<std::thread> m_threads;
};

Workers::Workers(int threads) : m_count(threads > 0 ? threads : usableProcessors())
{
    if (m_count > 1)
        m_impl = std::make_unique<Impl>(m_count);
}

Workers::~Workers() = default;

void Workers::runErased(size_t count, size_t grain, void* context, Erased body) const
{
    if (count == 0)
        return;
    grain = std::max<size_t>(1, grain);
    const int nested = m_impl != nullptr ? m_impl->workerHere() : -1;
    if (m_impl == nullptr || count <= grain) {
        body(context, 0, count, std::max(0, nested));
        return;
    }
    Impl::Job job{count, grain, (count - 1) / grain + 1, context, body, t_frame};
    if (nested >= 0)
        m_impl->work(job, nested); // by this worker alone: the others are busy with the outer job
    else
        m_impl->run(job);
    if (job.error)
        std::rethrow_exception(job.error);
}

} // namespace gsc
