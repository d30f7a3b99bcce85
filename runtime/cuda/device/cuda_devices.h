// SPDX-License-Identifier: Apache-2.0
// The GPUs that there are. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

namespace gsc {

// That the process sees; 0 where there is no driver.
int cudaDeviceCount();

// Looks at one. Starts the driver, which takes some tenths of a second.
DeviceInfo lookAtCudaDevice(int ordinal);

} // namespace gsc
