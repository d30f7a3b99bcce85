// SPDX-License-Identifier: Apache-2.0
// Bytes that a buffer takes in an arena. Where CUDA is emulated, tests/cuda_emulation/include has a header of the same
// path, which is found first and catches accesses outside of a buffer.
#pragma once

#include <cstddef>

namespace gsc {

// Bytes reserved for a buffer of `bytes`, so that the next buffer is aligned for any load. `at` is null while sizes
// are only counted.
inline size_t arenaRoom(void* /*at*/, size_t bytes)
{
    constexpr size_t kAlign = 256;
    return (bytes + kAlign - 1) / kAlign * kAlign;
}

} // namespace gsc
