// SPDX-License-Identifier: Apache-2.0
// Workers without TBB, for a player that shall be one file.
#include "kernels/threads/parallel.h"

#include "format/machine/threads.h"
#include "kernels/threads/plain_pool.h"

namespace gsc {

struct Workers::Impl : PlainPool {
    using PlainPool::PlainPool;
};

Workers::Workers(int threads) : m_count(poolThreads(threads))
{
    if (m_count > 1)
        m_impl = std::make_unique<Impl>(m_count);
}

Workers::~Workers() = default;

void Workers::run(size_t count, size_t grain, const Body& body) const
{
    if (count == 0)
        return;
    if (m_impl == nullptr || count <= grain)
        body(0, count, 0);
    else
        m_impl->run(count, grain, body);
}

} // namespace gsc
