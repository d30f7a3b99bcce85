// SPDX-License-Identifier: Apache-2.0
// The ceilings of the CUDA device, measured. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

namespace gsc {

// On this thread's device, which has so many multiprocessors. Takes about 0.3 s and, while it runs, at most a quarter of
// the free memory, 2 GiB or `most_bytes`. Throws Error (OutOfMemory, Device).
DeviceCeilings measureCudaCeilings(uint32_t processors, uint64_t most_bytes);

} // namespace gsc
