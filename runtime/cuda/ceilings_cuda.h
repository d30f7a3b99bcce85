// SPDX-License-Identifier: Apache-2.0
// Measures the highest rates that a CUDA device reaches. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

namespace gsc {

// Measures the device of this thread, which has `processors` multiprocessors. Takes about 0.3 s. While it runs it
// needs at most `most_bytes`, a quarter of the free memory, and 2 GiB, whichever is least. Throws Error (OutOfMemory,
// Device).
DeviceCeilings measureCudaCeilings(uint32_t processors, uint64_t most_bytes);

} // namespace gsc
