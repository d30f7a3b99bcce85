// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/sort.h"

#include "kernels/threads/parallel.h"
#include "kernels/math/anchor.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>

namespace gsc {

namespace {

constexpr uint32_t kMostDigitBits = 11; // bits of a digit, such that three passes are enough for 32 bits
// keys per chunk at least; the cut into chunks depends on the number of keys alone, never on the threads
constexpr size_t kMinChunkKeys = 32768;
constexpr size_t kMaxChunks = 64; // largest number of chunks, enough for as many workers; each chunk needs a histogram

size_t chunkKeys(size_t count)
{
    return std::max(kMinChunkKeys, (count + kMaxChunks - 1) / kMaxChunks);
}

// Number that orders a slot among those of equal depth.
uint64_t orderOfSlot(const SortArgs& args, uint32_t slot)
{
    const uint32_t offsets = args.model->params->n_offsets;
    const uint32_t block = slot / args.block_capacity;
    const uint32_t origin = args.origins[slot];
    if (args.groups != nullptr) {
        const GroupRecord& group = args.model->groups[args.groups[block]];
        const uint32_t first = group.anchor_first - args.model->chunks[group.chunk].anchor_first;
        return emissionOrder(*args.model, group.chunk, first + origin / offsets, origin % offsets);
    }
    const VisibleAnchor& anchor = args.visible[size_t(block) * kDecodeBlock + origin / offsets];
    return emissionOrder(*args.model, anchor.chunk, anchor.local, origin % offsets);
}

// Smallest and largest depth of the keys, as bits.
struct DepthRange {
    std::atomic<uint32_t> low{~0u}, high{0};

    void add(uint32_t least, uint32_t most)
    {
        for (uint32_t now = low; least < now && !low.compare_exchange_weak(now, least);)
            ;
        for (uint32_t now = high; most > now && !high.compare_exchange_weak(now, most);)
            ;
    }
};

// Copies the keys of all blocks without gaps to keys[0]; returns their number, and their depths in `range`.
size_t gatherKeys(const SortArgs& args, const Workers& workers, SortScratch& scratch, DepthRange& range)
{
    scratch.block_first.reserve(args.block_count + 1);
    uint32_t total = 0;
    for (uint32_t b = 0; b < args.block_count; ++b) {
        scratch.block_first[b] = total;
        total += args.counts[b];
    }
    scratch.keys[0].reserve(total);
    scratch.keys[1].reserve(total);
    workers.run(args.block_count, 64, [&](size_t begin, size_t end, int) {
        uint32_t low = ~0u, high = 0;
        for (size_t b = begin; b < end; ++b) {
            SortKey* keys = scratch.keys[0].data() + scratch.block_first[b];
            const uint32_t slot = uint32_t(b) * args.block_capacity;
            for (uint32_t i = 0; i < args.counts[b]; ++i) {
                const uint32_t bits = args.depth_bits[slot + i];
                keys[i] = {bits, slot + i};
                low = std::min(low, bits);
                high = std::max(high, bits);
            }
        }
        range.add(low, high);
    });
    return total;
}

// A digit of a key: some bits of the difference between its depth and the smallest depth.
struct Digit {
    uint32_t low, shift, bits;

    [[nodiscard]] uint32_t of(const SortKey& key) const { return (key.depth_bits - low) >> shift & ((1u << bits) - 1); }
};

// Sorts stably by one digit, from `from` to `to`, by counting.
void radixPass(const Workers& workers, const SortKey* from, SortKey* to, size_t count, const Digit& digit,
               uint32_t* histograms, size_t chunks)
{
    const size_t step = chunkKeys(count);
    const uint32_t digits = 1u << digit.bits;
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            uint32_t* histogram = histograms + c * digits;
            std::memset(histogram, 0, digits * sizeof(uint32_t));
            const size_t last = std::min(count, (c + 1) * step);
            for (size_t i = c * step; i < last; ++i)
                ++histogram[digit.of(from[i])];
        }
    });
    uint32_t sum = 0;
    for (uint32_t d = 0; d < digits; ++d)
        for (size_t c = 0; c < chunks; ++c) {
            const uint32_t n = histograms[c * digits + d];
            histograms[c * digits + d] = sum;
            sum += n;
        }
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            uint32_t* next = histograms + c * digits;
            const size_t last = std::min(count, (c + 1) * step);
            for (size_t i = c * step; i < last; ++i)
                to[next[digit.of(from[i])]++] = from[i];
        }
    });
}

// Puts the keys of each run of equal depth in emission order; such runs are rare and short. All runs are found before
// any is sorted, so that no worker reads a run that another one writes.
void orderTies(const SortArgs& args, const Workers& workers, SortKey* keys, size_t count, size_t chunks,
               std::vector<std::vector<SortRun>>& runs)
{
    const size_t step = chunkKeys(count);
    runs.resize(std::max(runs.size(), chunks));
    // first slot whose splats are not ordered
    const uint64_t unordered = uint64_t(args.ordered_blocks) * args.block_capacity;
    const auto same = [keys](size_t i, size_t j) { return keys[i].depth_bits == keys[j].depth_bits; };
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            runs[c].clear();
            const size_t last = std::min(count, (c + 1) * step);
            for (size_t i = c * step; i < last; ++i) {
                if (i + 1 == count || !same(i, i + 1) || (i > 0 && same(i - 1, i)))
                    continue; // no run begins here
                size_t run_end = i + 2;
                while (run_end < count && same(i, run_end))
                    ++run_end;
                runs[c].push_back({i, run_end});
            }
        }
    });
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c)
            for (const SortRun& run : runs[c]) {
                // note: slots still ascend in a run
                const SortKey* const after = std::partition_point(
                    keys + run.begin, keys + run.end, [&](const SortKey& key) { return key.slot < unordered; });
                std::sort(keys + run.begin, keys + (after - keys), [&args](const SortKey& a, const SortKey& b) {
                    return orderOfSlot(args, a.slot) < orderOfSlot(args, b.slot);
                });
            }
    });
}

} // namespace

size_t sortCpu(const SortArgs& args, const Workers& workers, SortScratch& scratch)
{
    DepthRange range;
    const size_t count = gatherKeys(args, workers, scratch, range);
    if (count == 0)
        return 0;
    const size_t chunks = (count + chunkKeys(count) - 1) / chunkKeys(count);
    // note: uses only the bits in which depths differ, in as few passes as they need, and then with digits as short as
    // possible: the fewer places keys are written to at once, the better these stay in the first-level cache
    const uint32_t low = range.low, used = std::max(1u, uint32_t(std::bit_width(range.high - low)));
    const uint32_t passes = (used + kMostDigitBits - 1) / kMostDigitBits, bits = (used + passes - 1) / passes;
    scratch.histograms.reserve(chunks << bits);
    for (uint32_t pass = 0; pass < passes; ++pass) {
        radixPass(workers, scratch.keys[0].data(), scratch.keys[1].data(), count, {low, pass * bits, bits},
                  scratch.histograms.data(), chunks);
        std::swap(scratch.keys[0], scratch.keys[1]);
    }
    if (args.model != nullptr)
        orderTies(args, workers, scratch.keys[0].data(), count, chunks, scratch.runs);
    return count;
}

} // namespace gsc
