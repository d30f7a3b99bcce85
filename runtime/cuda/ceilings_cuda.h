// SPDX-License-Identifier: Apache-2.0
// The ceilings of the CUDA device, measured. Nothing here names a CUDA header.
#pragma once

#include "runtime/backend.h"

namespace gsc {

// On the device of makeCudaBackend(). Takes about 0.3 s and, while it runs, at most a quarter of the free memory, 2 GiB
// or `most_bytes`. Throws Error (OutOfMemory, Device).
DeviceCeilings measureCudaCeilings(uint64_t most_bytes);

} // namespace gsc
