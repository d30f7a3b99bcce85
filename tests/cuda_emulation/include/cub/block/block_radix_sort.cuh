// SPDX-License-Identifier: Apache-2.0
// Stands for CUB's header. As there, the storage may be used again only after a barrier.
#pragma once

#include "tests/cuda_emulation/intrinsics.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace cub {

template <typename Key, int kThreads, int kItems, typename Value, int kDigitBits>
class BlockRadixSort {
public:
    struct TempStorage {
        Key keys[kThreads * kItems];
        Value values[kThreads * kItems];
    };

    explicit BlockRadixSort(TempStorage& storage) : m_storage(storage) {}

    void SortBlockedToStriped(Key (&keys)[kItems], Value (&values)[kItems], int begin_bit, int end_bit)
    {
        for (int i = 0; i < kItems; ++i) {
            m_storage.keys[threadIdx.x * kItems + i] = keys[i];
            m_storage.values[threadIdx.x * kItems + i] = values[i];
        }
        __syncthreads();
        if (threadIdx.x == 0)
            sort(begin_bit, end_bit);
        __syncthreads();
        for (int i = 0; i < kItems; ++i) {
            keys[i] = m_storage.keys[i * kThreads + threadIdx.x];
            values[i] = m_storage.values[i * kThreads + threadIdx.x];
        }
    }

private:
    void sort(int begin_bit, int end_bit)
    {
        const std::vector<Key> keys(m_storage.keys, m_storage.keys + kThreads * kItems);
        const std::vector<Value> values(m_storage.values, m_storage.values + kThreads * kItems);
        const Key mask = Key((1ull << (end_bit - begin_bit)) - 1);
        std::vector<uint32_t> order(keys.size());
        std::iota(order.begin(), order.end(), 0u);
        std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
            return (keys[a] >> begin_bit & mask) < (keys[b] >> begin_bit & mask);
        });
        for (size_t i = 0; i < order.size(); ++i) {
            m_storage.keys[i] = keys[order[i]];
            m_storage.values[i] = values[order[i]];
        }
    }

    TempStorage& m_storage;
};

} // namespace cub
