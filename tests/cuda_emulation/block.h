// SPDX-License-Identifier: Apache-2.0
// How the emulation runs a grid: block after block, every thread of a block a fiber. A fiber runs until it must wait for
// others, so what a kernel leaves unsynchronised comes out in an order that the seed decides (GSC_EMULATION_SEED).
// Undefined behaviour of CUDA ends the program with a message: waiting for a lane that has left, lanes of a warp that
// wait for each other at different places, a shuffle from a lane not named, a barrier that can never be complete.
#pragma once

#include "tests/cuda_emulation/vector_types.h"

#include <cstddef>
#include <functional>

namespace gsc_emulation {

// Where lanes meet. Stricter than CUDA: the same intrinsic at another place in the source is another meeting.
struct Site {
    const char* what;     // intrinsic
    const char* function; // function that calls it
    int line;

    bool operator==(const Site& other) const { return what == other.what && line == other.line; }
};

// Runs body() once per thread. One grid at a time.
void runGrid(dim3 grid, dim3 block, size_t shared_bytes, const std::function<void()>& body);

// Called by threads of a running grid.

// Computes the results of all lanes in `mask`; operands[lane] is what the lane passed.
using Resolve = void (*)(const Site& site, uint32_t mask, void* const* operands);
// Waits for the lanes in `mask`; the last of them calls `resolve`.
void meetWarp(const Site& site, uint32_t mask, void* operand, Resolve resolve);
// Waits at barrier `id` for `threads` threads, 0 = all of the block; true if any of them says so.
bool meetBlock(const Site& site, uint32_t id, uint32_t threads, bool value);
// All others that can run do so before this one goes on.
void letOthersRun();
uint32_t laneOfWarp();
unsigned char* dynamicShared(); // memory of this block: bytes as in the launch, 0xff at first
[[noreturn]] void fail(const Site& site, const char* format, ...) __attribute__((format(printf, 2, 3)));

} // namespace gsc_emulation

// note: plain variables that every switch of fibers sets; one grid runs at a time
extern uint3 threadIdx, blockIdx;
extern dim3 blockDim, gridDim;
