// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "session.h"
#include "system.h"

namespace gsc::fake_xr {

namespace {

constexpr uint32_t kImages = 3;

std::vector<int64_t> offeredFormats(const Runtime& rt, const Session& session)
{
    if (!session.gpu)
        return {};
    if (rt.settings.formats)
        return *rt.settings.formats;
    std::vector<int64_t> formats{VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_R8G8B8A8_UNORM};
    if (rt.enabled(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME))
        formats.push_back(VK_FORMAT_D32_SFLOAT);
    return formats;
}

void checkUsage(const XrSwapchainCreateInfo& info, const PixelFormat& format)
{
    constexpr XrSwapchainUsageFlags kKnown =
        XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT |
        XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT | XR_SWAPCHAIN_USAGE_TRANSFER_SRC_BIT |
        XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT | XR_SWAPCHAIN_USAGE_SAMPLED_BIT | XR_SWAPCHAIN_USAGE_MUTABLE_FORMAT_BIT |
        XR_SWAPCHAIN_USAGE_INPUT_ATTACHMENT_BIT_MND;
    const XrSwapchainUsageFlags usage = info.usageFlags;
    if (usage == 0 || (usage & ~kKnown) != 0)
        refuse(XR_ERROR_VALIDATION_FAILURE, "usageFlags is 0 or has an unknown bit");
    const XrSwapchainUsageFlags others =
        format.depth ? XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT
                     : XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT;
    if ((usage & others) != 0)
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "usageFlags has a bit that the format cannot have");
    const bool srgb = info.format == VK_FORMAT_R8G8B8A8_SRGB || info.format == VK_FORMAT_B8G8R8A8_SRGB;
    if (srgb && (usage & XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT) != 0) // as real runtimes: no GPU stores to sRGB
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "usageFlags has UNORDERED_ACCESS for an sRGB format");
    if ((usage & XR_SWAPCHAIN_USAGE_INPUT_ATTACHMENT_BIT_MND) != 0)
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "usageFlags has INPUT_ATTACHMENT, whose extension is not offered");
}

void checkSwapchain(const Runtime& rt, const Session& session, const XrSwapchainCreateInfo& info)
{
    const std::vector<int64_t> formats = offeredFormats(rt, session);
    const std::optional<PixelFormat> format = pixelFormat(info.format);
    if (std::find(formats.begin(), formats.end(), info.format) == formats.end() || !format)
        refuse(XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED,
               formatString("format %lld is not offered", static_cast<long long>(info.format)));
    checkUsage(info, *format);
    if (info.createFlags != 0)
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "createFlags is not 0");
    if (info.width == 0 || info.height == 0 || info.width > kMaxSwapchainSize || info.height > kMaxSwapchainSize)
        refuse(XR_ERROR_VALIDATION_FAILURE,
               formatString("size %ux%u, expected 1 to %u", info.width, info.height, kMaxSwapchainSize));
    if (info.sampleCount == 0 || info.faceCount == 0 || info.arraySize == 0 || info.mipCount == 0)
        refuse(XR_ERROR_VALIDATION_FAILURE, "a count is 0");
    if (info.sampleCount != 1 || info.faceCount != 1)
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "sampleCount or faceCount is not 1");
    if (!session.gpu->supports(info))
        refuse(XR_ERROR_FEATURE_UNSUPPORTED, "the device has no such image");
}

} // namespace

XrResult xrEnumerateSwapchainFormats(XrSession handle, uint32_t capacity, uint32_t* count, int64_t* out)
{
    return guarded("xrEnumerateSwapchainFormats", [&](Runtime& rt) {
        const Session& session = rt.requireSession(handle);
        return listOut(offeredFormats(rt, session), capacity, count, out);
    });
}

XrResult xrCreateSwapchain(XrSession handle, const XrSwapchainCreateInfo* info, XrSwapchain* out)
{
    return guarded("xrCreateSwapchain", [&](Runtime& rt) {
        Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_SWAPCHAIN_CREATE_INFO, "createInfo");
        requirePointer(out, "swapchain");
        if (!session.gpu)
            refuse(XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED, "a headless session has no swapchains");
        checkSwapchain(rt, session, *info);
        const uint64_t id = rt.next_id++;
        Swapchain& swapchain = session.swapchains[id];
        swapchain.info = *info;
        swapchain.info.next = nullptr;
        for (uint32_t i = 0; i < kImages; ++i)
            swapchain.images.push_back(session.gpu->createImage(*info));
        *out = handleOf<XrSwapchain>(id);
        return XR_SUCCESS;
    });
}

XrResult xrDestroySwapchain(XrSwapchain handle)
{
    return guarded("xrDestroySwapchain", WhenLost::Work, [&](Runtime& rt) {
        if (!rt.session || !rt.session->swapchains.contains(idOf(handle)))
            refuse(XR_ERROR_HANDLE_INVALID, "no such swapchain");
        const auto found = rt.session->swapchains.find(idOf(handle));
        rt.session->gpu->destroyImages(found->second.images);
        rt.session->swapchains.erase(found);
        return XR_SUCCESS;
    });
}

XrResult xrEnumerateSwapchainImages(XrSwapchain handle, uint32_t capacity, uint32_t* count,
                                    XrSwapchainImageBaseHeader* out)
{
    return guarded("xrEnumerateSwapchainImages", [&](Runtime& rt) {
        const Swapchain& swapchain = rt.requireSwapchain(handle);
        auto* images = reinterpret_cast<XrSwapchainImageVulkan2KHR*>(out);
        std::vector<XrSwapchainImageVulkan2KHR> list;
        for (uint32_t i = 0; i < swapchain.images.size(); ++i) {
            const bool given = out != nullptr && i < capacity;
            if (given)
                requireType(&images[i], XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR, "images");
            list.push_back(
                {XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR, given ? images[i].next : nullptr, swapchain.images[i].image});
        }
        return listOut(list, capacity, count, images);
    });
}

XrResult xrAcquireSwapchainImage(XrSwapchain handle, const XrSwapchainImageAcquireInfo* info, uint32_t* out)
{
    return guarded("xrAcquireSwapchainImage", [&](Runtime& rt) {
        Swapchain& swapchain = rt.requireSwapchain(handle);
        watchThread(rt, *rt.session, "xrAcquireSwapchainImage");
        allowType(info, XR_TYPE_SWAPCHAIN_IMAGE_ACQUIRE_INFO, "acquireInfo");
        requirePointer(out, "index");
        if (swapchain.acquired.size() == swapchain.images.size())
            refuse(XR_ERROR_CALL_ORDER_INVALID, "all images of the swapchain are acquired already");
        GpuImage& image = swapchain.images[swapchain.next];
        if (!image.laid_out) // here and not at creation: the queue may be used in this call
            rt.session->gpu->layOut(image, swapchain.info);
        *out = swapchain.next;
        swapchain.acquired.push_back(swapchain.next);
        swapchain.next = (swapchain.next + 1) % uint32_t(swapchain.images.size());
        return XR_SUCCESS;
    });
}

XrResult xrWaitSwapchainImage(XrSwapchain handle, const XrSwapchainImageWaitInfo* info)
{
    return guarded("xrWaitSwapchainImage", [&](Runtime& rt) {
        Swapchain& swapchain = rt.requireSwapchain(handle);
        watchThread(rt, *rt.session, "xrWaitSwapchainImage");
        requireType(info, XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO, "waitInfo");
        if (swapchain.acquired.empty() || swapchain.waited)
            refuse(XR_ERROR_CALL_ORDER_INVALID, "no image is acquired, or it was waited for already");
        swapchain.waited = true;
        return XR_SUCCESS;
    });
}

XrResult xrReleaseSwapchainImage(XrSwapchain handle, const XrSwapchainImageReleaseInfo* info)
{
    return guarded("xrReleaseSwapchainImage", [&](Runtime& rt) {
        Swapchain& swapchain = rt.requireSwapchain(handle);
        watchThread(rt, *rt.session, "xrReleaseSwapchainImage");
        allowType(info, XR_TYPE_SWAPCHAIN_IMAGE_RELEASE_INFO, "releaseInfo");
        if (!swapchain.waited)
            refuse(XR_ERROR_CALL_ORDER_INVALID, "no image was waited for");
        swapchain.released = swapchain.acquired.front();
        swapchain.acquired.pop_front();
        swapchain.waited = false;
        return XR_SUCCESS;
    });
}

} // namespace gsc::fake_xr
