// SPDX-License-Identifier: Apache-2.0
// Stands for CUB's header. As there, the storage may be used again only after a barrier.
#pragma once

#include "tests/cuda_emulation/intrinsics.h"

namespace cub {

template <typename T, int kThreads>
class BlockScan {
public:
    struct TempStorage {
        T values[kThreads];
    };

    explicit BlockScan(TempStorage& storage) : m_storage(storage) {}

    void ExclusiveSum(T in, T& out, T& total)
    {
        m_storage.values[threadIdx.x] = in;
        __syncthreads();
        T before{}, all{};
        for (uint32_t i = 0; i < uint32_t(kThreads); ++i) {
            if (i == threadIdx.x)
                before = all;
            all += m_storage.values[i];
        }
        out = before;
        total = all;
    }

private:
    TempStorage& m_storage;
};

} // namespace cub
