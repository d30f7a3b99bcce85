// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "system.h"

namespace gsc::fake_xr {

std::vector<XrViewConfigurationType> offeredConfigurations(const Runtime& rt)
{
    switch (rt.settings.configuration) {
    case Configuration::Mono:
        return {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_MONO};
    case Configuration::Quad:
        if (rt.enabled(XR_VARJO_QUAD_VIEWS_EXTENSION_NAME))
            return {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO, XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO};
        [[fallthrough]];
    case Configuration::Stereo:
        return {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO};
    }
    return {};
}

uint32_t requireConfiguration(const Runtime& rt, XrViewConfigurationType type)
{
    const std::vector<XrViewConfigurationType> offered = offeredConfigurations(rt);
    if (std::find(offered.begin(), offered.end(), type) == offered.end())
        refuse(XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED,
               formatString("view configuration %d is not offered", type));
    return type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_MONO     ? 1
           : type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO ? 2
                                                               : 4;
}

XrResult xrGetSystem(XrInstance instance, const XrSystemGetInfo* info, XrSystemId* out)
{
    return guarded("xrGetSystem", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requireType(info, XR_TYPE_SYSTEM_GET_INFO, "getInfo");
        requirePointer(out, "systemId");
        if (info->formFactor != XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY)
            refuse(XR_ERROR_FORM_FACTOR_UNSUPPORTED, formatString("form factor %d", info->formFactor));
        if (!rt.settings.system)
            refuse(XR_ERROR_FORM_FACTOR_UNAVAILABLE, "the settings say that there is no headset");
        *out = kSystem;
        return XR_SUCCESS;
    });
}

XrResult xrGetSystemProperties(XrInstance instance, XrSystemId system, XrSystemProperties* out)
{
    return guarded("xrGetSystemProperties", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        requireType(out, XR_TYPE_SYSTEM_PROPERTIES, "properties");
        out->systemId = kSystem;
        out->vendorId = 0;
        std::strcpy(out->systemName, "gsc fake headset");
        out->graphicsProperties = {kMaxSwapchainSize, kMaxSwapchainSize, kMaxLayers};
        out->trackingProperties = {XR_TRUE, XR_TRUE};
        if (auto* gaze = chainedOut<XrSystemEyeGazeInteractionPropertiesEXT>(
                out->next, XR_TYPE_SYSTEM_EYE_GAZE_INTERACTION_PROPERTIES_EXT))
            gaze->supportsEyeGazeInteraction = rt.settings.gaze.empty() ? XR_FALSE : XR_TRUE;
        return XR_SUCCESS;
    });
}

XrResult xrEnumerateViewConfigurations(XrInstance instance, XrSystemId system, uint32_t capacity, uint32_t* count,
                                       XrViewConfigurationType* out)
{
    return guarded("xrEnumerateViewConfigurations", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        return listOut(offeredConfigurations(rt), capacity, count, out);
    });
}

XrResult xrGetViewConfigurationProperties(XrInstance instance, XrSystemId system, XrViewConfigurationType type,
                                          XrViewConfigurationProperties* out)
{
    return guarded("xrGetViewConfigurationProperties", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        requireConfiguration(rt, type);
        requireType(out, XR_TYPE_VIEW_CONFIGURATION_PROPERTIES, "configurationProperties");
        out->viewConfigurationType = type;
        out->fovMutable = XR_TRUE;
        return XR_SUCCESS;
    });
}

XrResult xrEnumerateViewConfigurationViews(XrInstance instance, XrSystemId system, XrViewConfigurationType type,
                                           uint32_t capacity, uint32_t* count, XrViewConfigurationView* out)
{
    return guarded("xrEnumerateViewConfigurationViews", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        std::vector<XrViewConfigurationView> views;
        for (uint32_t i = 0; i < requireConfiguration(rt, type); ++i) {
            const ViewSettings& v = rt.settings.views[i];
            views.push_back({XR_TYPE_VIEW_CONFIGURATION_VIEW, nullptr, v.width, v.width * kMaxViewScale, v.height,
                             v.height * kMaxViewScale, 1, 1});
            if (out != nullptr && i < capacity) {
                requireType(&out[i], XR_TYPE_VIEW_CONFIGURATION_VIEW, "views");
                views.back().next = out[i].next;
            }
        }
        return listOut(views, capacity, count, out);
    });
}

XrResult xrEnumerateEnvironmentBlendModes(XrInstance instance, XrSystemId system, XrViewConfigurationType type,
                                          uint32_t capacity, uint32_t* count, XrEnvironmentBlendMode* out)
{
    return guarded("xrEnumerateEnvironmentBlendModes", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        requireConfiguration(rt, type);
        return listOut(std::vector{XR_ENVIRONMENT_BLEND_MODE_OPAQUE}, capacity, count, out);
    });
}

} // namespace gsc::fake_xr
