// SPDX-License-Identifier: Apache-2.0
// Measures one kind of work at a time, at the device's full speed, as the ceiling of the stages' times.
#pragma once

#include <cstddef>
#include <cstdint>

struct CUstream_st;

namespace gsc {

constexpr size_t kCeilingPieceBytes = 32768; // bytes that one block moves; buffers are a multiple of it

// Device memory. Asynchronous, as all of these.
// fills memory with numbers, each different from the others
void fillCuda(void* target, size_t bytes, CUstream_st* stream);
void copyCuda(const void* source, void* target, size_t bytes, CUstream_st* stream);
void readCuda(const void* source, size_t bytes, uint32_t* sink, CUstream_st* stream);

// Registers only, enough warps to fill `processors` multiprocessors. Each returns how much one launch does. Nothing is
// written to `sink`, one word; it keeps the compiler from dropping the work.
double fmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream); // fp32 multiply-adds
double expCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream); // ex2.approx
// mma.sync.m16n8k16 with factors of fp16 and sums of fp32, as decode uses it; two operations per multiply-add.
double mmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream);

} // namespace gsc
