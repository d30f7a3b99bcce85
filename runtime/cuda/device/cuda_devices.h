// SPDX-License-Identifier: Apache-2.0
// Lists the GPUs. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

namespace gsc {

// Number of devices that the process can use; 0 if there is no driver.
int cudaDeviceCount();

// Returns the facts of one device. Starts the driver, which takes some tenths of a second.
DeviceInfo lookAtCudaDevice(int ordinal);

} // namespace gsc
