// SPDX-License-Identifier: Apache-2.0
#include "runtime/order_cuda.h"

namespace gsc {

void CudaOrder::drop()
{
    m_memory.release();
    m_known = false;
}

void CudaOrder::prepare()
{
    layOutIn(m_memory, "the order cache", [this](ArenaLayout& layout) {
        for (uint32_t*& depths : m_depths)
            depths = layout.take<uint32_t>(kDepthBuckets);
    });
    m_known = false;
}

OrderJob CudaOrder::job() const
{
    return {m_known ? m_depths[m_last] : nullptr, m_depths[1 - m_last]};
}

void CudaOrder::end()
{
    m_last = 1 - m_last;
    m_known = true;
}

} // namespace gsc
