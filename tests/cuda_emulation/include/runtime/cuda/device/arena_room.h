// SPDX-License-Identifier: Apache-2.0
// Stands for the header of this path: a piece is given out anew, and 256 bytes behind it are nobody's, to write there is an
// error.
#pragma once

#include <cuda_runtime_api.h>

namespace gsc {

inline size_t arenaRoom(void* at, size_t bytes)
{
    constexpr size_t kAlign = 256;
    const size_t all = (bytes + kAlign - 1) / kAlign * kAlign + kAlign;
    if (at != nullptr)
        gsc_emulation::handOut(at, bytes, all);
    return all;
}

} // namespace gsc
