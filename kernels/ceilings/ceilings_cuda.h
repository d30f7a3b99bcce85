// SPDX-License-Identifier: Apache-2.0
// Measures how fast a device does one kind of work by itself: upper limits with which the times of stages are compared.
#pragma once

#include <cstddef>
#include <cstdint>

struct CUstream_st;

namespace gsc {

constexpr size_t kCeilingPieceBytes = 32768; // bytes that one block moves; the sizes of buffers are multiples of it

// Work on device memory. Asynchronous, as are all functions here. fillCuda() fills memory with numbers, each different
// from the others.
void fillCuda(void* target, size_t bytes, CUstream_st* stream);
void copyCuda(const void* source, void* target, size_t bytes, CUstream_st* stream);
void readCuda(const void* source, size_t bytes, uint32_t* sink, CUstream_st* stream);

// Work on registers only, in enough warps to fill `processors` multiprocessors. Each function returns the number of
// operations of a launch. `sink` is one word, to which nothing is written; it keeps the compiler from removing the
// work.
double fmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream); // does fp32 multiply-adds
double expCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream); // does ex2.approx instructions
// Does mma.sync.m16n8k16 with fp16 factors and fp32 sums, as decode does; a multiply-add counts as two operations.
double mmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream);

} // namespace gsc
