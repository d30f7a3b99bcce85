// SPDX-License-Identifier: Apache-2.0
// Makes the scorer for the pictures of a renderer.
#pragma once

#include "runtime/metrics/picture_scorer.h"
#include <gsc/renderer.h>

namespace gsc {

// Makes a scorer that takes pictures on the renderer's device; null if that is the CPU, or cannot score. Throws
// Error(Device).
std::unique_ptr<PictureScorer> makeDeviceScorer(const Renderer& renderer);

// Bytes of a device's memory that are free now; 0 if the device is the CPU.
uint64_t freeDeviceBytes(const DeviceId& device);

} // namespace gsc
