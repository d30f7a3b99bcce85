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
    const auto layOut = [this](ArenaLayout& layout) {
        for (uint32_t*& depths : m_depths)
            depths = layout.take<uint32_t>(kDepthBuckets);
    };
    ArenaLayout counted(nullptr);
    layOut(counted);
    m_memory.reserve(counted.bytes(), "the order cache");
    ArenaLayout layout(m_memory.get());
    layOut(layout);
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
