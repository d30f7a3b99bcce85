// SPDX-License-Identifier: Apache-2.0
// An OpenXR runtime and the headset that it finds, with the Vulkan device that both use.
#pragma once

#include "player/present/headset/headset.h"
#include "player/present/headset/xr_call.h"

namespace gsc {

class XrRuntime {
public:
    // finds runtime and headset, and makes the device; throws Error: Unsupported, Device
    explicit XrRuntime(const HeadsetOptions& options);
    ~XrRuntime();
    XrRuntime(const XrRuntime&) = delete;
    XrRuntime& operator=(const XrRuntime&) = delete;

    [[nodiscard]] bool has(const char* extension) const;

    XrInstance instance = XR_NULL_HANDLE;
    XrSystemId system = XR_NULL_SYSTEM_ID;
    XrViewConfigurationType configuration = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
    XrEnvironmentBlendMode blend = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
    bool tracks_gaze = false;
    std::unique_ptr<VulkanDevice> device;
    HeadsetFacts facts; // facts that are known without a session

private:
    void makeInstance(bool depth);
    void findHeadset();
    void chooseViews(double scale);
    void makeDevice(const std::optional<DeviceUuid>& uuid);

    std::vector<const char*> m_extensions; // OpenXR extensions that are switched on
};

} // namespace gsc
