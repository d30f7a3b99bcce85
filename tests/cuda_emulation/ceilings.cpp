// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/ceilings_cuda.h"

namespace gsc {

DeviceCeilings measureCudaCeilings(uint32_t, uint64_t)
{
    return {}; // unknown: what the emulation reaches says nothing about a device
}

} // namespace gsc
