// SPDX-License-Identifier: Apache-2.0
// Pictures in memory of a GPU or page-locked for GPUs. Nothing here names a CUDA header.
#pragma once

#include "runtime/backend/picture_memory.h"

namespace gsc {

// allocatePages(), locked for copies if the driver allows it. Throws Error(OutOfMemory).
std::byte* allocatePageLocked(size_t bytes, int place);
void freePageLocked(std::byte* block, int place);

// Throws Error (OutOfMemory, Device).
std::shared_ptr<PictureMemory> cudaPictures(int ordinal);

// From a renderer on another device, or on the host, to cudaPictures(). Copies go from device to device where they reach
// each other, which is tried; otherwise the driver takes them through host memory. Throws Error(Device).
std::unique_ptr<PictureBridge> cudaBridge(const PictureMemory& memory, const Renderer& renderer);

// How copies go between two devices: "NVLink", "PCIe" (from device to device) or "host" (through its memory).
std::string cudaLink(int from, int to);

} // namespace gsc
