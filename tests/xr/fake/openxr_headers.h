// SPDX-License-Identifier: Apache-2.0
#pragma once

// The one include of OpenXR and Vulkan in the fake runtime: types only, no prototypes. It defines OpenXR's functions
// itself, and it calls Vulkan through the application's vkGetInstanceProcAddr.
#define XR_NO_PROTOTYPES
#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

#include <ctime>
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>
