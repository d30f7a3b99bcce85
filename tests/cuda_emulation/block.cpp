// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda_emulation/block.h"

#include "tests/cuda_emulation/fiber.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <numeric>
#include <utility>
#include <vector>

uint3 threadIdx, blockIdx;
dim3 blockDim, gridDim;

namespace gsc_emulation {

namespace {

constexpr uint32_t kMaxThreads = 1024, kWarpSize = 32, kBarriers = 16;
constexpr uint32_t kNobody = ~0u;
constexpr uint32_t kMostYields = 100'000'000; // in a row, while nobody meets or leaves

struct Thread {
    Fiber fiber;
    uint3 at;
    bool exited;
    Site waits; // waits.what == nullptr: it does not wait
};

struct Meeting { // meeting of lanes of a warp
    Site site;
    Resolve resolve;
    uint32_t mask, arrived;
    void* operands[kWarpSize];
};

struct Warp {
    std::vector<Meeting> open;
    uint32_t exited;
};

struct Barrier {
    Site site;
    uint32_t expected;
    bool value;
    std::vector<uint32_t> waiting;
    bool results[kMaxThreads]; // by thread, of the last time
};

// In which order the threads that can run do so. One warp running ahead of all others finds a missing barrier of the
// block, all in turn finds one of the warp.
enum class Order { Random, LastFirst, FirstFirst, Count };

struct Scheduler {
    std::mutex one_grid;
    uint64_t random = 0;
    std::vector<Thread> threads; // as many as any block has had
    Warp warps[kMaxThreads / kWarpSize];
    Barrier barriers[kBarriers];
    uint32_t count = 0, alive = 0, current = kNobody, yields = 0;
    Fiber caller;
    const std::function<void()>* body = nullptr;
    unsigned char* shared = nullptr;
    Order order = Order::Random;
    uint32_t ready[2 * kMaxThreads], first = 0, ready_count = 0;

    Scheduler()
    {
        const char* seed = std::getenv("GSC_EMULATION_SEED");
        random = (seed != nullptr ? std::strtoull(seed, nullptr, 10) : 1) * 0x9e3779b97f4a7c15ull | 1;
        threads.reserve(kMaxThreads);
    }

    uint32_t below(uint32_t n) // xorshift64*
    {
        random ^= random >> 12;
        random ^= random << 25;
        random ^= random >> 27;
        return uint32_t((random * 0x2545f4914f6cdd1dull >> 32) * n >> 32);
    }

    void push(uint32_t thread) { ready[(first + ready_count++) % (2 * kMaxThreads)] = thread; }

    uint32_t take()
    {
        if (ready_count == 0)
            return kNobody;
        --ready_count;
        if (order == Order::LastFirst)
            return ready[(first + ready_count) % (2 * kMaxThreads)];
        uint32_t& head = ready[first];
        if (order == Order::Random)
            std::swap(head, ready[(first + below(ready_count + 1)) % (2 * kMaxThreads)]);
        first = (first + 1) % (2 * kMaxThreads);
        return head;
    }
};

Scheduler s;

void reportWaits()
{
    std::vector<bool> told(s.count, false);
    for (uint32_t i = 0; i < s.count; ++i) {
        const Site site = s.threads[i].waits;
        if (site.what == nullptr || s.threads[i].exited || told[i])
            continue;
        std::fprintf(stderr, "  %s in %s, line %d: threads", site.what, site.function, site.line);
        uint32_t listed = 0, same = 0;
        for (uint32_t j = i; j < s.count; ++j)
            if (!s.threads[j].exited && s.threads[j].waits.what != nullptr && s.threads[j].waits == site) {
                told[j] = true;
                ++same;
                if (listed++ < 16)
                    std::fprintf(stderr, " %u", j);
            }
        std::fprintf(stderr, "%s (%u)\n", same > 16 ? " ..." : "", same);
    }
    std::fprintf(stderr, "  exited: %u of %u threads\n", s.count - s.alive, s.count);
}

// Runs another thread; returns when this one is to run again.
void yieldTo(uint32_t next)
{
    const uint32_t me = s.current;
    if (next != me) {
        s.current = next;
        switchFiber(s.threads[me].fiber, s.threads[next].fiber);
    }
    threadIdx = s.threads[me].at;
}

void wait(const Site& site)
{
    s.threads[s.current].waits = site;
    const uint32_t next = s.take();
    if (next == kNobody)
        fail(site, "no thread of the block can go on");
    yieldTo(next);
}

// Lets threads base + [0, count) that `chosen` picks run, in an order that changes.
template <typename Chosen>
void release(uint32_t base, uint32_t count, Chosen chosen)
{
    s.yields = 0;
    uint32_t span = 1;
    while (span < count)
        span *= 2;
    const uint32_t turn = s.below(span);
    for (uint32_t i = 0; i < span; ++i)
        if (const uint32_t j = i ^ turn; j < count && chosen(j)) {
            s.threads[base + j].waits = {};
            s.push(base + j);
        }
}

void checkBarriers()
{
    for (const Barrier& b : s.barriers)
        if (!b.waiting.empty() && b.expected > s.alive)
            fail(b.site, "waits for %u threads, of which %u have left", b.expected, b.expected - s.alive);
}

void exitThread()
{
    const uint32_t me = s.current, lane = me % kWarpSize;
    Warp& warp = s.warps[me / kWarpSize];
    s.threads[me].exited = true;
    s.yields = 0;
    warp.exited |= 1u << lane;
    --s.alive;
    for (const Meeting& m : warp.open)
        if (m.mask >> lane & 1u)
            fail(m.site, "mask %08x names lane %u, which leaves the kernel", m.mask, lane);
    checkBarriers();
    const uint32_t next = s.take();
    if (next != kNobody) {
        yieldTo(next);
        return;
    }
    if (s.alive != 0)
        fail({"exit", "the kernel", 0}, "no thread of the block can go on");
    s.current = kNobody;
    switchFiber(s.threads[me].fiber, s.caller);
    threadIdx = s.threads[me].at;
}

// note: a fiber is a thread of one block after the other, so its outermost frame stays and no stack is set up again
void threadMain()
{
    enterFiber();
    threadIdx = s.threads[s.current].at;
    while (true) {
        (*s.body)();
        exitThread();
    }
}

void startBlock(dim3 block, size_t shared_bytes)
{
    s.count = s.alive = block.x * block.y * block.z;
    while (s.threads.size() < s.count)
        s.threads.push_back({makeFiber(threadMain), {}, false, {}});
    for (uint32_t i = 0; i < s.count; ++i) {
        Thread& t = s.threads[i];
        t.at = {i % block.x, i / block.x % block.y, i / block.x / block.y};
        t.exited = false;
        t.waits = {};
    }
    for (uint32_t w = 0; w * kWarpSize < s.count; ++w) {
        const uint32_t lanes = s.count - w * kWarpSize;
        s.warps[w].exited = lanes < kWarpSize ? ~0u << lanes : 0u;
        s.warps[w].open.clear();
    }
    void* memory = nullptr;
    if (shared_bytes != 0) {
        if (posix_memalign(&memory, 128, shared_bytes) != 0)
            std::abort();
        std::memset(memory, 0xff, shared_bytes);
    }
    s.shared = static_cast<unsigned char*>(memory);
    s.order = Order(s.below(uint32_t(Order::Count)));
    s.first = s.ready_count = 0;
    release(0, s.count, [](uint32_t) { return true; });
}

} // namespace

void fail(const Site& site, const char* format, ...)
{
    std::fflush(stdout);
    std::fprintf(stderr, "cuda emulation: %s in %s, line %d, block (%u, %u, %u), thread %u: ", site.what, site.function,
                 site.line, blockIdx.x, blockIdx.y, blockIdx.z, s.current);
    va_list list;
    va_start(list, format);
    std::vfprintf(stderr, format, list);
    va_end(list);
    std::fprintf(stderr, "\n");
    reportWaits();
    std::abort();
}

void runGrid(dim3 grid, dim3 block, size_t shared_bytes, const std::function<void()>& body)
{
    const std::lock_guard lock(s.one_grid);
    s.body = &body;
    s.caller = callersFiber();
    gridDim = grid;
    blockDim = block;
    std::vector<uint32_t> blocks(size_t(grid.x) * grid.y * grid.z);
    std::iota(blocks.begin(), blocks.end(), 0u);
    for (uint32_t i = uint32_t(blocks.size()); i > 1; --i)
        std::swap(blocks[i - 1], blocks[s.below(i)]);
    for (const uint32_t b : blocks) {
        blockIdx = {b % grid.x, b / grid.x % grid.y, b / grid.x / grid.y};
        startBlock(block, shared_bytes);
        s.current = s.take();
        switchFiber(s.caller, s.threads[s.current].fiber);
        std::free(s.shared);
    }
}

void meetWarp(const Site& site, uint32_t mask, void* operand, Resolve resolve)
{
    const uint32_t me = s.current, lane = me % kWarpSize;
    Warp& warp = s.warps[me / kWarpSize];
    if ((mask >> lane & 1u) == 0)
        fail(site, "mask %08x does not name the calling lane %u", mask, lane);
    if ((mask & warp.exited) != 0)
        fail(site, "mask %08x names lanes %08x, which have left the kernel", mask, mask & warp.exited);
    if (mask == 1u << lane) {
        void* operands[kWarpSize] = {};
        operands[lane] = operand;
        resolve(site, mask, operands);
        return;
    }
    Meeting* meeting = nullptr;
    for (Meeting& m : warp.open)
        if (m.site == site && m.mask == mask && m.resolve == resolve)
            meeting = &m;
    if (meeting == nullptr) {
        warp.open.push_back({site, resolve, mask, 0, {}});
        meeting = &warp.open.back();
    }
    meeting->operands[lane] = operand;
    meeting->arrived |= 1u << lane;
    for (const Meeting& m : warp.open)
        if (&m != meeting && (m.arrived & mask) != 0 && (m.mask & meeting->arrived) != 0)
            fail(site, "mask %08x waits for lanes %08x, which wait with mask %08x at %s in %s, line %d", mask,
                 m.arrived & mask, m.mask, m.site.what, m.site.function, m.site.line);
    if (meeting->arrived == mask) {
        resolve(site, mask, meeting->operands);
        std::swap(*meeting, warp.open.back());
        warp.open.pop_back();
        release(me - lane, kWarpSize, [&](uint32_t l) { return (mask >> l & 1u) != 0; });
        yieldTo(s.take());
    } else {
        wait(site);
    }
}

bool meetBlock(const Site& site, uint32_t id, uint32_t threads, bool value)
{
    const uint32_t expected = threads != 0 ? threads : s.count, me = s.current;
    if (id >= kBarriers || expected > s.count || (expected % kWarpSize != 0 && expected != s.count))
        fail(site, "barrier %u for %u threads, expected at most %u of them, whole warps, and barrier 0 to 15", id,
             expected, s.count);
    Barrier& b = s.barriers[id];
    if (b.waiting.empty()) {
        b.site = site;
        b.expected = expected;
        b.value = false;
    } else if (!(b.site == site) || b.expected != expected) {
        fail(site, "barrier %u for %u threads; others wait there for %u at %s in %s, line %d", id, expected, b.expected,
             b.site.what, b.site.function, b.site.line);
    }
    b.value |= value;
    b.waiting.push_back(me);
    s.threads[me].waits = site;
    checkBarriers();
    if (b.waiting.size() < expected) {
        wait(site);
    } else {
        std::vector<bool> here(s.count, false);
        for (const uint32_t t : b.waiting) {
            here[t] = true;
            b.results[t] = b.value;
        }
        b.waiting.clear();
        release(0, s.count, [&](uint32_t t) { return bool(here[t]); });
        yieldTo(s.take());
    }
    return b.results[me];
}

void letOthersRun()
{
    if (++s.yields > kMostYields)
        fail({"__nanosleep", "the kernel", 0}, "waits for what no thread of the block does");
    const uint32_t size = 2 * kMaxThreads;
    if (s.order == Order::LastFirst) {
        s.first = (s.first + size - 1) % size;
        s.ready[s.first] = s.current;
        ++s.ready_count;
    } else {
        s.push(s.current);
    }
    yieldTo(s.take());
}

uint32_t laneOfWarp()
{
    return s.current % kWarpSize;
}

unsigned char* dynamicShared()
{
    return s.shared;
}

} // namespace gsc_emulation
