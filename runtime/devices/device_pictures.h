// SPDX-License-Identifier: Apache-2.0
// Chooses the memory for pictures of a device, among the backends of this build.
#pragma once

#include "runtime/backend/picture_memory.h"

namespace gsc {

// Returns memory of this process. `page_locked`: for fast copies from a GPU, if the build has CUDA.
std::shared_ptr<PictureMemory> hostPictures(bool page_locked);

// Returns memory of that device, or of this process if the device is the CPU.
std::shared_ptr<PictureMemory> devicePictures(const DeviceId& device);

// Makes the bridge by which a renderer delivers into `memory` that it cannot draw into. Throws Error(Device).
std::unique_ptr<PictureBridge> bridgeTo(const PictureMemory& memory, const Renderer& renderer);

} // namespace gsc
