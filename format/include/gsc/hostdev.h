// SPDX-License-Identifier: Apache-2.0
// Bottom of everything: the one macro that lets a function serve the CPU backend and a CUDA kernel.
#pragma once

#if defined(__CUDACC__)
#define GSC_HD __host__ __device__ __forceinline__
#else
#define GSC_HD inline
#endif
