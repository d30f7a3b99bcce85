// SPDX-License-Identifier: Apache-2.0
// Memory that is asked for ahead: whole lines, as many as the ranges touch, a few at a time.
#include "kernels/simd/read_ahead.h"

#include <doctest/doctest.h>

#include <vector>

using namespace gsc;

TEST_CASE("a range is the lines that it touches, and asking takes them away")
{
    alignas(64) char memory[640];
    ReadAhead ahead;
    ahead.add(memory, 0);
    CHECK(ahead.lines() == 0);
    ahead.ask(3);
    CHECK(ahead.lines() == 0);
    ahead.add(memory, 64);
    CHECK(ahead.lines() == 1);
    ahead.add(memory + 63, 2);
    CHECK(ahead.lines() == 3);
    ahead.add(memory + 64, 65);
    CHECK(ahead.lines() == 5);
    ahead.ask(2); // into the second range
    CHECK(ahead.lines() == 3);
    ahead.ask(0);
    CHECK(ahead.lines() == 3);
    ahead.ask(100);
    CHECK(ahead.lines() == 0);
}

TEST_CASE("ranges without room are left out, and what was asked for makes room")
{
    std::vector<char> memory(64 * 200);
    ReadAhead ahead;
    const auto fill = [&] {
        for (size_t i = 0; i < 200; ++i)
            ahead.add(memory.data() + 64 * i, 1);
        return ahead.lines();
    };
    const size_t most = fill();
    CHECK(most >= 56); // eight strips, three arrays of the model and two entries of two pieces each
    CHECK(most < 200);
    ahead.ask(most);
    CHECK(fill() == most);
}
