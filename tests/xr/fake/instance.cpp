// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "runtime.h"

#include <openxr/openxr_reflection.h>

namespace gsc::fake_xr {

namespace {

#define GSC_FAKE_XR_NAME(name, number) {name, #name},
constexpr std::pair<XrResult, const char*> kResults[] = {XR_LIST_ENUM_XrResult(GSC_FAKE_XR_NAME)};
constexpr std::pair<XrStructureType, const char*> kStructures[] = {XR_LIST_ENUM_XrStructureType(GSC_FAKE_XR_NAME)};
#undef GSC_FAKE_XR_NAME

XrResult copyText(const std::string& text, char* out, size_t capacity)
{
    requirePointer(out, "buffer");
    std::snprintf(out, capacity, "%s", text.c_str());
    return XR_SUCCESS;
}

std::vector<XrExtensionProperties> offeredExtensions(const Settings& settings)
{
    std::vector<XrExtensionProperties> offered;
    const auto offer = [&](const char* name, uint32_t version) {
        if (std::find(settings.extensions_withheld.begin(), settings.extensions_withheld.end(), name) !=
            settings.extensions_withheld.end())
            return;
        XrExtensionProperties& extension =
            offered.emplace_back(XrExtensionProperties{XR_TYPE_EXTENSION_PROPERTIES, nullptr, {}, version});
        std::strncpy(extension.extensionName, name, sizeof extension.extensionName - 1);
    };
    offer(XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME, XR_KHR_vulkan_enable2_SPEC_VERSION);
    offer(XR_MND_HEADLESS_EXTENSION_NAME, XR_MND_headless_SPEC_VERSION);
    offer(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME, XR_KHR_composition_layer_depth_SPEC_VERSION);
    offer(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME, XR_KHR_convert_timespec_time_SPEC_VERSION);
    offer(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME, XR_FB_display_refresh_rate_SPEC_VERSION);
    if (settings.visibility_mask)
        offer(XR_KHR_VISIBILITY_MASK_EXTENSION_NAME, XR_KHR_visibility_mask_SPEC_VERSION);
    if (!settings.gaze.empty())
        offer(XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME, XR_EXT_eye_gaze_interaction_SPEC_VERSION);
    if (settings.configuration == Configuration::Quad)
        offer(XR_VARJO_QUAD_VIEWS_EXTENSION_NAME, XR_VARJO_quad_views_SPEC_VERSION);
    return offered;
}

std::set<std::string> wantedExtensions(const Settings& settings, const XrInstanceCreateInfo& info)
{
    const std::vector<XrExtensionProperties> offered = offeredExtensions(settings);
    std::set<std::string> wanted;
    for (uint32_t i = 0; i < info.enabledExtensionCount; ++i) {
        const std::string name = info.enabledExtensionNames[i];
        const auto same = [&](const XrExtensionProperties& e) { return name == e.extensionName; };
        if (std::none_of(offered.begin(), offered.end(), same))
            refuse(XR_ERROR_EXTENSION_NOT_PRESENT, name + " is not offered");
        wanted.insert(name);
    }
    return wanted;
}

bool pathWellFormed(const std::string& text)
{
    const auto allowed = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.' || c == '/';
    };
    return text.size() > 1 && text.size() < XR_MAX_PATH_LENGTH && text.front() == '/' && text.back() != '/' &&
           text.find("//") == std::string::npos && std::all_of(text.begin(), text.end(), allowed);
}

} // namespace

XrResult xrEnumerateInstanceExtensionProperties(const char* layer, uint32_t capacity, uint32_t* count,
                                                XrExtensionProperties* out)
{
    return guarded("xrEnumerateInstanceExtensionProperties", [&](Runtime& rt) {
        if (layer != nullptr)
            refuse(XR_ERROR_API_LAYER_NOT_PRESENT, "the runtime has no layers");
        rt.readSettings();
        for (uint32_t i = 0; out != nullptr && i < capacity; ++i)
            requireType(&out[i], XR_TYPE_EXTENSION_PROPERTIES, "properties");
        return listOut(offeredExtensions(rt.settings), capacity, count, out);
    });
}

XrResult xrEnumerateApiLayerProperties(uint32_t, uint32_t* count, XrApiLayerProperties*)
{
    return guarded("xrEnumerateApiLayerProperties", [&](Runtime&) {
        requirePointer(count, "the count");
        *count = 0;
        return XR_SUCCESS;
    });
}

XrResult xrCreateInstance(const XrInstanceCreateInfo* info, XrInstance* out)
{
    return guarded("xrCreateInstance", WhenLost::Work, [&](Runtime& rt) {
        rt.readSettings();
        requireType(info, XR_TYPE_INSTANCE_CREATE_INFO, "createInfo");
        requirePointer(out, "instance");
        if (rt.instance != 0)
            refuse(XR_ERROR_LIMIT_REACHED, "there is an instance already");
        if (info->applicationInfo.applicationName[0] == '\0')
            refuse(XR_ERROR_NAME_INVALID, "applicationName is empty");
        const XrVersion version = info->applicationInfo.apiVersion;
        if (XR_VERSION_MAJOR(version) != 1 || XR_VERSION_MINOR(version) != 0)
            refuse(XR_ERROR_API_VERSION_UNSUPPORTED,
                   formatString("apiVersion %d.%d, expected 1.0", int(XR_VERSION_MAJOR(version)),
                                int(XR_VERSION_MINOR(version))));
        rt.createInstance(wantedExtensions(rt.settings, *info));
        *out = handleOf<XrInstance>(rt.instance);
        return XR_SUCCESS;
    });
}

XrResult xrDestroyInstance(XrInstance instance)
{
    return guarded("xrDestroyInstance", WhenLost::Work, [&](Runtime& rt) {
        rt.requireInstance(instance);
        rt.destroyInstance();
        return XR_SUCCESS;
    });
}

XrResult xrGetInstanceProperties(XrInstance instance, XrInstanceProperties* out)
{
    return guarded("xrGetInstanceProperties", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requireType(out, XR_TYPE_INSTANCE_PROPERTIES, "instanceProperties");
        out->runtimeVersion = XR_MAKE_VERSION(1, 0, 0);
        std::strcpy(out->runtimeName, "gsc fake runtime");
        return XR_SUCCESS;
    });
}

XrResult xrPollEvent(XrInstance instance, XrEventDataBuffer* out)
{
    return guarded("xrPollEvent", WhenLost::Work, [&](Runtime& rt) {
        rt.requireInstance(instance);
        requireType(out, XR_TYPE_EVENT_DATA_BUFFER, "eventData");
        Session* session = rt.session.get();
        if (rt.events.empty() && session != nullptr && session->polls_to_restart && --*session->polls_to_restart == 0) {
            session->polls_to_restart.reset();
            rt.setState(XR_SESSION_STATE_READY);
        }
        if (rt.events.empty() && rt.instance_lost) // its own event was still to be read
            refuse(XR_ERROR_INSTANCE_LOST, "the instance is lost");
        if (rt.events.empty())
            return XR_EVENT_UNAVAILABLE;
        *out = rt.events.front();
        rt.events.pop_front();
        return XR_SUCCESS;
    });
}

XrResult xrResultToString(XrInstance instance, XrResult value, char out[XR_MAX_RESULT_STRING_SIZE])
{
    return guarded("xrResultToString", WhenLost::Work, [&](Runtime& rt) {
        rt.requireInstance(instance);
        for (const auto& [known, name] : kResults)
            if (known == value)
                return copyText(name, out, XR_MAX_RESULT_STRING_SIZE);
        const char* unknown = XR_FAILED(value) ? "XR_UNKNOWN_FAILURE_" : "XR_UNKNOWN_SUCCESS_";
        return copyText(unknown + std::to_string(value), out, XR_MAX_RESULT_STRING_SIZE);
    });
}

XrResult xrStructureTypeToString(XrInstance instance, XrStructureType value, char out[XR_MAX_STRUCTURE_NAME_SIZE])
{
    return guarded("xrStructureTypeToString", WhenLost::Work, [&](Runtime& rt) {
        rt.requireInstance(instance);
        for (const auto& [known, name] : kStructures)
            if (known == value)
                return copyText(name, out, XR_MAX_STRUCTURE_NAME_SIZE);
        return copyText("XR_UNKNOWN_STRUCTURE_TYPE_" + std::to_string(value), out, XR_MAX_STRUCTURE_NAME_SIZE);
    });
}

XrResult xrStringToPath(XrInstance instance, const char* text, XrPath* out)
{
    return guarded("xrStringToPath", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requirePointer(text, "pathString");
        requirePointer(out, "path");
        if (!pathWellFormed(text))
            refuse(XR_ERROR_PATH_FORMAT_INVALID, text);
        *out = rt.pathOf(text);
        return XR_SUCCESS;
    });
}

XrResult xrPathToString(XrInstance instance, XrPath path, uint32_t capacity, uint32_t* count, char* out)
{
    return guarded("xrPathToString", [&](Runtime& rt) {
        rt.requireInstance(instance);
        std::string text = rt.requirePath(path);
        text.push_back('\0'); // OpenXR counts it
        return listOut(text, capacity, count, out);
    });
}

} // namespace gsc::fake_xr
