// SPDX-License-Identifier: Apache-2.0
// Memory for pictures on a GPU, and page-locked memory for pictures that come from GPUs. Nothing here names a CUDA
// header.
#pragma once

#include "runtime/backend/picture_memory.h"

namespace gsc {

// Does as allocatePages(), and locks the pages for fast copies if the driver allows it. Throws Error(OutOfMemory).
std::byte* allocatePageLocked(size_t bytes, int place);
void freePageLocked(std::byte* block, int place);

// Returns the memory for pictures of a device. Throws Error (OutOfMemory, Device).
std::shared_ptr<PictureMemory> cudaPictures(int ordinal);

// Makes the bridge by which a renderer on another device, or on the host, delivers into cudaPictures(). Copies go
// directly from device to device if that works, else the driver copies through host memory. Throws Error(Device).
std::unique_ptr<PictureBridge> cudaBridge(const PictureMemory& memory, const Renderer& renderer);

// Returns how copies go between two devices: "NVLink", "PCIe" (directly) or "host" (through host memory).
std::string cudaLink(int from, int to);

} // namespace gsc
