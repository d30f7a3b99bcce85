// SPDX-License-Identifier: Apache-2.0
// GSC_HD, the one macro that makes a function usable both on a CPU and in a CUDA kernel.
#pragma once

#if defined(__CUDACC__)
#define GSC_HD __host__ __device__ __forceinline__
#else
#define GSC_HD inline
#endif
