// SPDX-License-Identifier: Apache-2.0
// Workers, compiled once with each of its implementations.
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

using gsc::Workers;

TEST_CASE("every index is visited once, in ranges no longer than the grain")
{
    for (const int threads : {1, 2, 3, 8}) {
        const Workers workers(threads);
        REQUIRE(workers.count() == threads);
        for (const size_t count : {0u, 1u, 2u, 63u, 64u, 65u, 1000u, 4097u})
            for (const size_t grain : {0u, 1u, 7u, 64u, 5000u}) {
                CAPTURE(threads);
                CAPTURE(count);
                CAPTURE(grain);
                std::vector<std::atomic<int>> visits(count);
                std::atomic<bool> fits{true};
                workers.run(count, grain, [&](size_t begin, size_t end, int worker) {
                    const bool all = threads == 1 && begin == 0 && end == count;
                    if (begin >= end || end > count || worker < 0 || worker >= threads ||
                        (end - begin > std::max<size_t>(1, grain) && !all))
                        fits = false;
                    for (size_t i = begin; i < end; ++i)
                        ++visits[i];
                });
                CHECK(fits);
                bool once = true;
                for (const std::atomic<int>& n : visits)
                    once &= n == 1;
                CHECK(once);
            }
    }
}

TEST_CASE("a worker runs one range at a time, also with more workers than cores and callers than one")
{
    const Workers workers(5);
    std::vector<std::atomic<int>> inside(5);
    std::atomic<bool> alone{true};
    std::atomic<size_t> sum{0};
    const auto job = [&] {
        for (int repeat = 0; repeat < 200; ++repeat)
            workers.run(50, 1, [&](size_t begin, size_t, int worker) {
                if (++inside[size_t(worker)] != 1)
                    alone = false;
                sum += begin;
                --inside[size_t(worker)];
            });
    };
    std::thread other(job);
    job();
    other.join();
    CHECK(alone);
    CHECK(sum == 2u * 200u * (49u * 50u / 2u));
}

TEST_CASE("no thread misses a job that follows another at once, or after a pause")
{
    const Workers workers(4);
    size_t total = 0;
    for (int repeat = 0; repeat < 3000; ++repeat) {
        std::atomic<size_t> seen{0};
        workers.run(8, 1, [&](size_t begin, size_t end, int) { seen += end - begin; });
        total += seen;
        if (repeat % 500 == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    CHECK(total == 3000u * 8u);
}

TEST_CASE("all workers take part")
{
    // each range waits for the others, so that one worker alone would never end
    const Workers workers(3);
    std::atomic<int> arrived{0};
    workers.run(3, 1, [&](size_t, size_t, int) {
        ++arrived;
        while (arrived < 3)
            std::this_thread::yield();
    });
    CHECK(arrived == 3);
}

TEST_CASE("a body's exception reaches the caller, and the workers go on working")
{
    for (const int threads : {1, 2, 6}) {
        const Workers workers(threads);
        for (int repeat = 0; repeat < 50; ++repeat) {
            const auto failing = [&] {
                workers.run(1000, 1, [&](size_t begin, size_t end, int) {
                    if (begin <= 500 && 500 < end)
                        throw std::runtime_error("range 500");
                });
            };
            CHECK_THROWS_WITH_AS(failing(), "range 500", std::runtime_error);
            const auto all_fail = [&] { workers.run(100, 1, [](size_t, size_t, int) { throw 7; }); };
            CHECK_THROWS_AS(all_fail(), int);
            std::atomic<size_t> seen{0};
            workers.run(100, 3, [&](size_t begin, size_t end, int) { seen += end - begin; });
            CHECK(seen == 100);
        }
    }
}

TEST_CASE("0 threads are as many as there are processors")
{
    const Workers workers(0);
    CHECK(workers.count() >= 1);
    CHECK(workers.count() <= int(std::max(1u, std::thread::hardware_concurrency())));
}
