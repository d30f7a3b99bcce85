// SPDX-License-Identifier: Apache-2.0
// The memory for pictures that a device has, of the backends of this build.
#pragma once

#include "runtime/backend/picture_memory.h"

namespace gsc {

// Memory of this process; page-locked for copies from a GPU, of a build that has CUDA.
std::shared_ptr<PictureMemory> hostPictures(bool page_locked);

// Memory of that device; the host's for one that is the host.
std::shared_ptr<PictureMemory> devicePictures(const DeviceId& device);

// Makes the bridge for a renderer that cannot draw into `memory`. Throws Error(Device).
std::unique_ptr<PictureBridge> bridgeTo(const PictureMemory& memory, const Renderer& renderer);

} // namespace gsc
