// SPDX-License-Identifier: Apache-2.0
// The scorer for what a renderer draws.
#pragma once

#include "runtime/metrics/picture_scorer.h"
#include <gsc/renderer.h>

namespace gsc {

// One that takes pictures of the renderer's device; null where that is the host, or has none. Throws Error(Device).
std::unique_ptr<PictureScorer> makeDeviceScorer(const Renderer& renderer);

// Bytes of a device's memory that are free now; 0 where it is the host.
uint64_t freeDeviceBytes(const DeviceId& device);

} // namespace gsc
