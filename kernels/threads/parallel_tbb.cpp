// SPDX-License-Identifier: Apache-2.0
#include "kernels/threads/parallel.h"

#include "format/machine/threads.h"
#include "kernels/threads/plain_pool.h"
#include "kernels/threads/tbb_bound.h"

#include <algorithm>
#include <optional>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

namespace gsc {

namespace {

struct TbbPool {
    // note: TBB starts no more workers than there are cores unless told so; tests ask for more
    explicit TbbPool(int threads)
        : control(tbb::global_control::max_allowed_parallelism,
                  std::max<size_t>(size_t(threads), size_t(tbb::info::default_concurrency()))),
          arena(threads)
    {
    }

    void run(size_t count, size_t grain, const Workers::Body& body)
    {
        arena.execute([&] {
            tbb::parallel_for(
                tbb::blocked_range<size_t>(0, count, std::max<size_t>(1, grain)),
                [&](const tbb::blocked_range<size_t>& range) {
                    body(range.begin(), range.end(), tbb::this_task_arena::current_thread_index());
                },
                tbb::simple_partitioner());
        });
    }

    tbb::global_control control;
    tbb::task_arena arena;
};

} // namespace

// TBB, or plain threads if these are short, since TBB cannot work with fewer threads than it wants.
struct Workers::Impl {
    Impl(int threads, bool are_short)
    {
        if (are_short)
            plain.emplace(threads);
        else
            tbb.emplace(threads);
    }

    std::optional<TbbPool> tbb;
    std::optional<PlainPool> plain;
};

Workers::Workers(int threads) : m_count(poolThreads(threads))
{
    if (m_count > 1)
        m_impl = std::make_unique<Impl>(m_count, boundTbb(threads));
}

Workers::~Workers() = default;

void Workers::run(size_t count, size_t grain, const Body& body) const
{
    if (count == 0)
        return;
    if (m_impl == nullptr || count <= grain)
        body(0, count, 0);
    else if (m_impl->tbb)
        m_impl->tbb->run(count, grain, body);
    else
        m_impl->plain->run(count, grain, body);
}

} // namespace gsc
