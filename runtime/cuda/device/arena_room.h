// SPDX-License-Identifier: Apache-2.0
// Size that a buffer takes in an arena. Where CUDA is emulated, a header of the same path comes before this one
// (tests/cuda_emulation/include), and catches accesses outside a buffer.
#pragma once

#include <cstddef>

namespace gsc {

// Bytes reserved for a piece of `bytes`, so that the next is aligned for any load. `at`: null while pieces are counted.
inline size_t arenaRoom(void* /*at*/, size_t bytes)
{
    constexpr size_t kAlign = 256;
    return (bytes + kAlign - 1) / kAlign * kAlign;
}

} // namespace gsc
