// SPDX-License-Identifier: Apache-2.0
// Turns OpenXR's results into errors and its poses into ours, and fills its structures.
#pragma once

#include "player/present/vulkan_device.h"
#include "player/poses/placement.h"

#include <ctime> // must come before OpenXR's header, which uses timespec

#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace gsc {

// Throws Error, "`what` failed", for a result that is no success: Unsupported if a runtime or a headset is missing,
// else Device.
void checkXr(XrResult result, const char* what);
// Does as checkXr(), for the first calls: a runtime that fails there counts as missing (Unsupported).
void checkXrStart(XrResult result, const char* what);

// Makes an OpenXR structure and sets the member `type`.
template <typename Info>
Info xrInfo(XrStructureType type, const void* next = nullptr)
{
    Info info{};
    info.type = type;
    info.next = const_cast<void*>(next);
    return info;
}

// Reads a list from OpenXR: asks for its length first, then for its items.
template <typename Item, typename List>
std::vector<Item> xrList(const char* what, const Item& empty, const List& list)
{
    uint32_t count = 0;
    checkXrStart(list(0, &count, static_cast<Item*>(nullptr)), what);
    std::vector<Item> items(count, empty);
    checkXr(list(count, &count, items.data()), what);
    items.resize(count);
    return items;
}

// Looks up a function of an OpenXR extension. Throws Error(Device) if the runtime does not have it.
template <typename Function>
Function xrFunction(XrInstance instance, const char* name)
{
    PFN_xrVoidFunction function = nullptr;
    checkXr(xrGetInstanceProcAddr(instance, name, &function), name);
    return reinterpret_cast<Function>(function);
}

template <size_t Size>
void setXrText(char (&to)[Size], const char* text)
{
    size_t i = 0;
    for (; text[i] != 0 && i + 1 < Size; ++i)
        to[i] = text[i];
    to[i] = 0;
}

SpacePose poseOf(const XrPosef& pose);
XrPosef xrPose(const SpacePose& pose);

} // namespace gsc
