// SPDX-License-Identifier: Apache-2.0
// The GPUs that there are. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

namespace gsc {

// Number of devices that the process sees; 0 if there is no driver.
int cudaDeviceCount();

// Looks at one. Starts the driver, which takes some tenths of a second.
DeviceInfo lookAtCudaDevice(int ordinal);

} // namespace gsc
