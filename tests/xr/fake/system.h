// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime.h"

namespace gsc::fake_xr {

constexpr uint32_t kMaxSwapchainSize = 16384; // one image may hold several views
constexpr uint32_t kMaxViewScale = 2;         // times the recommended width and height
constexpr uint32_t kMaxLayers = 16;

std::vector<XrViewConfigurationType> offeredConfigurations(const Runtime& rt);
// Refuses what is not offered; the count of its views.
uint32_t requireConfiguration(const Runtime& rt, XrViewConfigurationType type);

} // namespace gsc::fake_xr
