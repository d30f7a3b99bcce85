// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "runtime.h"

namespace gsc::fake_xr {

namespace {

// The loader's interface of a runtime, version 1. libopenxr-dev does not install its header.
constexpr int kLoaderInfo = 1, kRuntimeRequest = 3;
constexpr uint32_t kInterfaceVersion = 1;

struct LoaderInfo {
    int struct_type;
    uint32_t struct_version;
    size_t struct_size;
    uint32_t min_interface_version, max_interface_version;
    XrVersion min_api_version, max_api_version;
};

struct RuntimeRequest {
    int struct_type;
    uint32_t struct_version;
    size_t struct_size;
    uint32_t runtime_interface_version;
    XrVersion runtime_api_version;
    PFN_xrGetInstanceProcAddr get_instance_proc_addr;
};

struct Entry {
    const char* name;
    const char* extension;
    PFN_xrVoidFunction function;
};

constexpr const char* kWithoutInstance[] = {"xrEnumerateInstanceExtensionProperties", "xrEnumerateApiLayerProperties",
                                            "xrCreateInstance", "xrGetInstanceProcAddr"};

const Entry* find(const char* name)
{
#define GSC_FAKE_XR_ENTRY(function, extension) {#function, extension, reinterpret_cast<PFN_xrVoidFunction>(&function)},
    static const Entry kTable[] = {GSC_FAKE_XR_FUNCTIONS(GSC_FAKE_XR_ENTRY)};
#undef GSC_FAKE_XR_ENTRY
    for (const Entry& entry : kTable)
        if (std::strcmp(entry.name, name) == 0)
            return &entry;
    return nullptr;
}

} // namespace

// Not logged when it refuses: the loader asks for everything it knows.
XrResult xrGetInstanceProcAddr(XrInstance instance, const char* name, PFN_xrVoidFunction* out)
{
    if (name == nullptr || out == nullptr)
        return XR_ERROR_VALIDATION_FAILURE;
    *out = nullptr;
    Runtime& rt = runtime();
    const std::lock_guard lock(rt.mutex);
    const auto same = [&](const char* known) { return std::strcmp(known, name) == 0; };
    if (instance == XR_NULL_HANDLE && std::none_of(std::begin(kWithoutInstance), std::end(kWithoutInstance), same))
        return XR_ERROR_HANDLE_INVALID;
    if (instance != XR_NULL_HANDLE && idOf(instance) != rt.instance)
        return XR_ERROR_HANDLE_INVALID;
    const Entry* entry = find(name);
    if (entry == nullptr || (*entry->extension != '\0' && !rt.enabled(entry->extension)))
        return XR_ERROR_FUNCTION_UNSUPPORTED;
    *out = entry->function;
    return XR_SUCCESS;
}

extern "C" __attribute__((visibility("default"))) XrResult xrNegotiateLoaderRuntimeInterface(const LoaderInfo* loader,
                                                                                             RuntimeRequest* request)
{
    if (loader == nullptr || request == nullptr || loader->struct_type != kLoaderInfo ||
        request->struct_type != kRuntimeRequest || loader->min_interface_version > kInterfaceVersion ||
        loader->max_interface_version < kInterfaceVersion)
        return XR_ERROR_INITIALIZATION_FAILED;
    request->runtime_interface_version = kInterfaceVersion;
    request->runtime_api_version = XR_MAKE_VERSION(1, 0, XR_VERSION_PATCH(XR_CURRENT_API_VERSION));
    request->get_instance_proc_addr = &xrGetInstanceProcAddr;
    return XR_SUCCESS;
}

} // namespace gsc::fake_xr
