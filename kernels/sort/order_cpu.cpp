// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/order.h"

#include "kernels/common/parallel.h"
#include "kernels/sort/sort_keys.h"

#include <algorithm>
#include <atomic>

namespace gsc {

namespace {

constexpr size_t kMinChunkKeys = 32768; // the split depends on the counts alone, never on the threads
constexpr size_t kMaxChunks = 64;
constexpr uint32_t kMaxSmall = 1024;  // keys of a bucket that is placed by its depths; they stay in the first cache
constexpr uint32_t kSmallCells = 256; // places

bool before(const SortArgs& args, const SortKey& a, const SortKey& b)
{
    if (a.depth_bits != b.depth_bits)
        return a.depth_bits < b.depth_bits;
    return orderOfSlot(args, a.slot) < orderOfSlot(args, b.slot);
}

// Splits the blocks into chunks of about as many keys.
void splitBlocks(const SortArgs& args, size_t count, SortScratch& scratch)
{
    const size_t step = std::max(kMinChunkKeys, (count + kMaxChunks - 1) / kMaxChunks);
    scratch.chunk_blocks.assign(1, 0);
    for (uint32_t b = 0; b < args.block_count; ++b)
        if (scratch.block_first[b] - scratch.block_first[scratch.chunk_blocks.back()] >= step)
            scratch.chunk_blocks.push_back(b);
    scratch.chunk_blocks.push_back(args.block_count);
}

// Calls body(index, depth_bits, slot) for the keys of a chunk; the index counts those of all blocks.
template <typename Body>
void forEachKey(const SortArgs& args, const SortScratch& scratch, size_t chunk, Body&& body)
{
    for (uint32_t b = scratch.chunk_blocks[chunk]; b < scratch.chunk_blocks[chunk + 1]; ++b) {
        const size_t first = scratch.block_first[b];
        const uint32_t slot = b * args.block_capacity, count = args.counts[b];
        for (uint32_t i = 0; i < count; ++i)
            body(first + i, args.depth_bits[slot + i], slot + i);
    }
}

// Finds each key's bucket, and how many of each chunk fall into each.
void findBuckets(const SortArgs& args, const Workers& workers, const OrderCache& cache, SortScratch& scratch)
{
    const size_t chunks = scratch.chunk_blocks.size() - 1, buckets = cache.buckets();
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            uint32_t* histogram = scratch.histograms.data() + c * buckets;
            uint16_t* found = scratch.buckets.data();
            std::fill_n(histogram, buckets, 0u);
            forEachKey(args, scratch, c, [&](size_t i, uint32_t depth_bits, uint32_t) {
                const uint32_t bucket = cache.bucket(depth_bits);
                found[i] = uint16_t(bucket);
                ++histogram[bucket];
            });
        }
    });
}

// From counts to places. Returns the keys in buckets that are too large to be placed by their depths.
size_t placeBuckets(size_t chunks, size_t buckets, SortScratch& scratch)
{
    uint32_t sum = 0;
    size_t large = 0;
    for (size_t bucket = 0; bucket < buckets; ++bucket) {
        const uint32_t first = sum;
        scratch.bucket_first[bucket] = first;
        for (size_t c = 0; c < chunks; ++c) {
            uint32_t& n = scratch.histograms[c * buckets + bucket];
            const uint32_t count = n;
            n = sum;
            sum += count;
        }
        if (sum - first > kMaxSmall)
            large += sum - first;
    }
    scratch.bucket_first[buckets] = sum;
    return large;
}

void scatterKeys(const SortArgs& args, const Workers& workers, size_t buckets, SortScratch& scratch)
{
    workers.run(scratch.chunk_blocks.size() - 1, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            uint32_t* next = scratch.histograms.data() + c * buckets;
            const uint16_t* found = scratch.buckets.data();
            SortKey* to = scratch.keys[1].data();
            forEachKey(args, scratch, c, [&](size_t i, uint32_t depth_bits, uint32_t slot) {
                to[next[found[i]]++] = {depth_bits, slot};
            });
        }
    });
}

// Sorts one bucket from `from` to `to`: every key to the place that its depth has between the least and the greatest,
// then in by insertion. Returns how many were inserted.
uint64_t sortBucket(const SortArgs& args, const SortKey* from, SortKey* to, uint32_t count)
{
    uint32_t lowest = UINT32_MAX, highest = 0;
    for (uint32_t i = 0; i < count; ++i) {
        lowest = std::min(lowest, from[i].depth_bits);
        highest = std::max(highest, from[i].depth_bits);
    }
    const uint64_t scale = (uint64_t(kSmallCells) << 32) / (uint64_t(highest - lowest) + 1);
    uint16_t next[kSmallCells + 1] = {};
    uint16_t cells[kMaxSmall];
    for (uint32_t i = 0; i < count; ++i) {
        cells[i] = uint16_t((from[i].depth_bits - lowest) * scale >> 32);
        ++next[cells[i] + 1];
    }
    for (uint32_t i = 1; i < kSmallCells; ++i)
        next[i] = uint16_t(next[i] + next[i - 1]);
    for (uint32_t i = 0; i < count; ++i)
        to[next[cells[i]]++] = from[i];
    uint64_t moves = 0;
    for (uint32_t i = 1; i < count; ++i) {
        const SortKey key = to[i];
        // note: the first comparison settles nearly all, and needs no call
        if (to[i - 1].depth_bits < key.depth_bits || before(args, to[i - 1], key))
            continue;
        uint32_t j = i;
        do
            to[j] = to[j - 1];
        while (--j > 0 && before(args, key, to[j - 1]));
        to[j] = key;
        ++moves;
    }
    return moves;
}

} // namespace

void OrderCache::learn(const SortKey* keys, size_t count)
{
    if (count == 0)
        return clear();
    uint32_t shift = 0;
    while ((count >> shift) / kStep + 1 >= kMaxBuckets)
        ++shift;
    const size_t step = size_t(kStep) << shift;
    m_rank_shift = 0;
    while ((size_t(1) << m_rank_shift) < step)
        ++m_rank_shift;
    m_lowest = keys[0].depth_bits;
    const uint32_t range = keys[count - 1].depth_bits - m_lowest;
    m_cell_shift = 0;
    while (range >> m_cell_shift >= kCells)
        ++m_cell_shift;
    m_ranks.resize(kCells + 1);
    // between two remembered splats, the rank rises evenly over the bits of the depth
    size_t low = 0;
    for (uint32_t cell = 0; cell <= kCells; ++cell) {
        const uint64_t border = uint64_t(m_lowest) + (uint64_t(cell) << m_cell_shift);
        while (low + step < count && keys[low + step].depth_bits < border)
            low += step;
        const size_t high = std::min(low + step, count - 1);
        const uint64_t a = keys[low].depth_bits, b = keys[high].depth_bits;
        size_t rank = high;
        if (border <= a)
            rank = low;
        else if (border < b)
            rank = low + size_t((high - low) * (border - a) / (b - a));
        m_ranks[cell] = uint32_t(rank);
    }
    m_buckets = uint32_t((count - 1) >> m_rank_shift) + 1;
}

size_t sortFromOrder(const SortArgs& args, const Workers& workers, SortScratch& scratch, OrderCache& cache,
                     uint64_t& moves)
{
    if (cache.empty()) {
        const size_t count = sortCpu(args, workers, scratch);
        moves = count;
        cache.learn(scratch.keys[0].data(), count);
        return count;
    }
    const size_t count = placeBlocks(args, scratch), buckets = cache.buckets();
    splitBlocks(args, count, scratch);
    const size_t chunks = scratch.chunk_blocks.size() - 1;
    scratch.histograms.reserve(chunks * buckets);
    scratch.bucket_first.reserve(buckets + 1);
    scratch.buckets.reserve(count);
    findBuckets(args, workers, cache, scratch);
    if (placeBuckets(chunks, buckets, scratch) > count / 8) { // another view altogether
        sortCpu(args, workers, scratch);
        moves = count;
    } else {
        scatterKeys(args, workers, buckets, scratch);
        std::atomic<uint64_t> moved{0};
        workers.run(buckets, 32, [&](size_t begin, size_t end, int) {
            uint64_t own = 0;
            for (size_t bucket = begin; bucket < end; ++bucket) {
                const uint32_t first = scratch.bucket_first[bucket], keys = scratch.bucket_first[bucket + 1] - first;
                SortKey *from = scratch.keys[1].data() + first, *to = scratch.keys[0].data() + first;
                if (keys <= kMaxSmall) {
                    own += sortBucket(args, from, to, keys);
                } else {
                    std::copy_n(from, keys, to);
                    std::sort(to, to + keys,
                              [&args](const SortKey& a, const SortKey& b) { return before(args, a, b); });
                    own += keys;
                }
            }
            moved += own;
        });
        moves = moved;
    }
    cache.learn(scratch.keys[0].data(), count);
    return count;
}

} // namespace gsc
