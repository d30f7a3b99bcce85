// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "openxr_headers.h"

#include <type_traits>

// Every function an application can reach, with the extension that has to be enabled for it ("" = none).
// clang-format off
#define GSC_FAKE_XR_FUNCTIONS(X) \
    /* instance.cpp */ \
    X(xrEnumerateInstanceExtensionProperties, "") X(xrEnumerateApiLayerProperties, "") X(xrCreateInstance, "") \
    X(xrDestroyInstance, "") X(xrGetInstanceProperties, "") X(xrPollEvent, "") X(xrResultToString, "") \
    X(xrStructureTypeToString, "") X(xrStringToPath, "") X(xrPathToString, "") \
    /* table.cpp */ \
    X(xrGetInstanceProcAddr, "") \
    /* system.cpp */ \
    X(xrGetSystem, "") X(xrGetSystemProperties, "") X(xrEnumerateViewConfigurations, "") \
    X(xrGetViewConfigurationProperties, "") X(xrEnumerateViewConfigurationViews, "") \
    X(xrEnumerateEnvironmentBlendModes, "") \
    /* vulkan_binding.cpp */ \
    X(xrGetVulkanGraphicsRequirements2KHR, "XR_KHR_vulkan_enable2") \
    X(xrCreateVulkanInstanceKHR, "XR_KHR_vulkan_enable2") \
    X(xrGetVulkanGraphicsDevice2KHR, "XR_KHR_vulkan_enable2") \
    X(xrCreateVulkanDeviceKHR, "XR_KHR_vulkan_enable2") \
    /* session.cpp */ \
    X(xrCreateSession, "") X(xrDestroySession, "") X(xrBeginSession, "") X(xrEndSession, "") \
    X(xrRequestExitSession, "") \
    /* spaces.cpp */ \
    X(xrEnumerateReferenceSpaces, "") X(xrCreateReferenceSpace, "") X(xrCreateActionSpace, "") \
    X(xrGetReferenceSpaceBoundsRect, "") X(xrDestroySpace, "") X(xrLocateSpace, "") X(xrLocateViews, "") \
    /* swapchains.cpp */ \
    X(xrEnumerateSwapchainFormats, "") X(xrCreateSwapchain, "") X(xrDestroySwapchain, "") \
    X(xrEnumerateSwapchainImages, "") X(xrAcquireSwapchainImage, "") X(xrWaitSwapchainImage, "") \
    X(xrReleaseSwapchainImage, "") \
    /* frame_loop.cpp */ \
    X(xrWaitFrame, "") X(xrBeginFrame, "") X(xrEndFrame, "") \
    /* actions.cpp */ \
    X(xrCreateActionSet, "") X(xrDestroyActionSet, "") X(xrCreateAction, "") X(xrDestroyAction, "") \
    X(xrSuggestInteractionProfileBindings, "") X(xrAttachSessionActionSets, "") \
    X(xrGetCurrentInteractionProfile, "") X(xrEnumerateBoundSourcesForAction, "") \
    X(xrGetInputSourceLocalizedName, "") \
    /* action_states.cpp */ \
    X(xrSyncActions, "") X(xrGetActionStateBoolean, "") X(xrGetActionStateFloat, "") \
    X(xrGetActionStateVector2f, "") X(xrGetActionStatePose, "") X(xrApplyHapticFeedback, "") \
    X(xrStopHapticFeedback, "") \
    /* small_extensions.cpp */ \
    X(xrGetVisibilityMaskKHR, "XR_KHR_visibility_mask") \
    X(xrConvertTimespecTimeToTimeKHR, "XR_KHR_convert_timespec_time") \
    X(xrConvertTimeToTimespecTimeKHR, "XR_KHR_convert_timespec_time") \
    X(xrEnumerateDisplayRefreshRatesFB, "XR_FB_display_refresh_rate") \
    X(xrGetDisplayRefreshRateFB, "XR_FB_display_refresh_rate") \
    X(xrRequestDisplayRefreshRateFB, "XR_FB_display_refresh_rate")
// clang-format on

namespace gsc::fake_xr {

#define GSC_FAKE_XR_DECLARE(name, extension) std::remove_pointer_t<PFN_##name> name;
GSC_FAKE_XR_FUNCTIONS(GSC_FAKE_XR_DECLARE)
#undef GSC_FAKE_XR_DECLARE

} // namespace gsc::fake_xr
