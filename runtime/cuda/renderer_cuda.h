// SPDX-License-Identifier: Apache-2.0
// The renderer on a GPU. Nothing here names a CUDA header.
#pragma once

#include <gsc/renderer.h>

namespace gsc {

// That the process sees; 0 where there is no driver.
int cudaDeviceCount();

// Looks at one. Starts the driver, which takes some tenths of a second.
DeviceInfo lookAtCudaDevice(int ordinal);

// Throws Error as lookAtCudaDevice() says, or OutOfMemory.
std::unique_ptr<Renderer> makeCudaRenderer(int ordinal, const RendererOptions& options);

} // namespace gsc
