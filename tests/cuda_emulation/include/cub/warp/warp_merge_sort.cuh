// SPDX-License-Identifier: Apache-2.0
// Stands for CUB's header. As there, the storage may be used again only after a __syncwarp.
#pragma once

#include "tests/cuda_emulation/intrinsics.h"

#include <algorithm>

namespace cub {

template <typename Key, int kItems, int kLanes>
class WarpMergeSort {
    static_assert(kLanes == 32);

public:
    struct TempStorage {
        Key keys[kLanes * kItems];
    };

    explicit WarpMergeSort(TempStorage& storage) : m_storage(storage) {}

    template <typename Compare>
    void Sort(Key (&keys)[kItems], Compare compare)
    {
        const uint32_t lane = gsc_emulation::laneOfWarp();
        for (int i = 0; i < kItems; ++i)
            m_storage.keys[i * kLanes + lane] = keys[i]; // where others read afterwards
        __syncwarp();
        if (lane == 0)
            std::sort(m_storage.keys, m_storage.keys + kLanes * kItems, compare);
        __syncwarp();
        for (int i = 0; i < kItems; ++i)
            keys[i] = m_storage.keys[lane * kItems + i];
    }

private:
    TempStorage& m_storage;
};

} // namespace cub
