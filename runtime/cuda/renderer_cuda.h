// SPDX-License-Identifier: Apache-2.0
// The renderer on a GPU. Nothing here names a CUDA header.
#pragma once

#include "runtime/cuda/device/cuda_devices.h"
#include <gsc/renderer.h>

namespace gsc {

// Makes a renderer on a GPU. Throws Error as lookAtCudaDevice() says, or OutOfMemory.
std::unique_ptr<Renderer> makeCudaRenderer(int ordinal, const RendererOptions& options);

} // namespace gsc
