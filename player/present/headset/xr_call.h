// SPDX-License-Identifier: Apache-2.0
// OpenXR's results as errors, its structures, and its poses as ours.
#pragma once

#include "player/present/vulkan_device.h"
#include "player/poses/placement.h"

#include <ctime> // before OpenXR's, which have a timespec

#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

namespace gsc {

// Throws Error, "`what` failed", for a result that is no success: Unsupported without a runtime or a headset, else
// Device.
void checkXr(XrResult result, const char* what);
// checkXr() for the first calls: a runtime that fails there counts as missing (Unsupported).
void checkXrStart(XrResult result, const char* what);

// A structure of OpenXR with its type field set.
template <typename Info>
Info xrInfo(XrStructureType type, const void* next = nullptr)
{
    Info info{};
    info.type = type;
    info.next = const_cast<void*>(next);
    return info;
}

// OpenXR's lists: asked for their length first.
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

// A function of an extension. Throws Error(Device) where the runtime does not have it.
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
