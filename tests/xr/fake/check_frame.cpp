// SPDX-License-Identifier: Apache-2.0
#include "submission.h"
#include "system.h"

#include <cmath>
#include <numbers>

namespace gsc::fake_xr {

namespace {

std::string rectText(const XrRect2Di& r)
{
    return formatString("%d,%d %dx%d", r.offset.x, r.offset.y, r.extent.width, r.extent.height);
}

const Swapchain& checkSubImage(Runtime& rt, const XrSwapchainSubImage& sub)
{
    const Swapchain& swapchain = rt.requireSwapchain(sub.swapchain);
    if (!swapchain.released)
        refuse(XR_ERROR_LAYER_INVALID, "no image of the swapchain was released yet");
    if (!swapchain.acquired.empty())
        refuse(XR_ERROR_LAYER_INVALID, "an image of the swapchain is acquired and not released");
    if (sub.imageArrayIndex >= swapchain.info.arraySize)
        refuse(XR_ERROR_VALIDATION_FAILURE,
               formatString("imageArrayIndex %u of %u", sub.imageArrayIndex, swapchain.info.arraySize));
    const XrRect2Di& r = sub.imageRect;
    if (r.offset.x < 0 || r.offset.y < 0 || r.extent.width <= 0 || r.extent.height <= 0 ||
        int64_t(r.offset.x) + r.extent.width > int64_t(swapchain.info.width) ||
        int64_t(r.offset.y) + r.extent.height > int64_t(swapchain.info.height))
        refuse(XR_ERROR_SWAPCHAIN_RECT_INVALID,
               formatString("imageRect %s leaves the image of %ux%u", rectText(r).c_str(), swapchain.info.width,
                            swapchain.info.height));
    return swapchain;
}

void checkFov(const XrFovf& fov)
{
    constexpr float kMost = float(std::numbers::pi / 2);
    const auto inside = [](float angle) { return angle > -kMost && angle < kMost; }; // false for NaN
    if (!inside(fov.angleLeft) || !inside(fov.angleRight) || !inside(fov.angleUp) || !inside(fov.angleDown) ||
        fov.angleLeft >= fov.angleRight || fov.angleDown >= fov.angleUp)
        refuse(XR_ERROR_VALIDATION_FAILURE,
               formatString(
                   "fov left %g right %g up %g down %g, expected left < right and down < up, each within 90 degrees",
                   double(fov.angleLeft), double(fov.angleRight), double(fov.angleUp), double(fov.angleDown)));
}

void checkDepth(Runtime& rt, const XrCompositionLayerDepthInfoKHR& depth, const XrRect2Di& picture)
{
    if (!rt.enabled(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME))
        refuse(XR_ERROR_VALIDATION_FAILURE, "XrCompositionLayerDepthInfoKHR without its extension");
    const Swapchain& swapchain = checkSubImage(rt, depth.subImage);
    if (!pixelFormat(swapchain.info.format)->depth)
        refuse(XR_ERROR_VALIDATION_FAILURE, "the depth's swapchain has a colour format");
    const XrRect2Di& rect = depth.subImage.imageRect;
    if (rect.offset.x != picture.offset.x || rect.offset.y != picture.offset.y ||
        rect.extent.width != picture.extent.width || rect.extent.height != picture.extent.height)
        refuse(XR_ERROR_SWAPCHAIN_RECT_INVALID, formatString("the depth's imageRect %s is not its picture's, %s",
                                                             rectText(rect).c_str(), rectText(picture).c_str()));
    if (!(depth.minDepth >= 0 && depth.minDepth < depth.maxDepth && depth.maxDepth <= 1))
        refuse(XR_ERROR_VALIDATION_FAILURE, "minDepth and maxDepth are no range within 0 to 1");
    if (!(depth.nearZ >= 0 && depth.farZ >= 0) || depth.nearZ == depth.farZ)
        refuse(XR_ERROR_VALIDATION_FAILURE, "nearZ or farZ is negative, or they are the same");
}

void checkView(Runtime& rt, const XrCompositionLayerProjectionView& view, const ViewSettings& limits)
{
    requireType(&view, XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW, "views");
    const XrVector3f& p = view.pose.position;
    if (!isUnit(view.pose.orientation) || !std::isfinite(p.x + p.y + p.z))
        refuse(XR_ERROR_POSE_INVALID, "a view's pose has no unit quaternion or no finite position");
    checkFov(view.fov);
    const Swapchain& swapchain = checkSubImage(rt, view.subImage);
    if (pixelFormat(swapchain.info.format)->depth)
        refuse(XR_ERROR_VALIDATION_FAILURE, "a view's swapchain has a depth format");
    const XrExtent2Di& size = view.subImage.imageRect.extent;
    if (uint32_t(size.width) > limits.width * kMaxViewScale || uint32_t(size.height) > limits.height * kMaxViewScale)
        refuse(XR_ERROR_SWAPCHAIN_RECT_INVALID, formatString("imageRect %s is larger than the view's maximum",
                                                             rectText(view.subImage.imageRect).c_str()));
    if (const auto* depth =
            chained<XrCompositionLayerDepthInfoKHR>(view.next, XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR))
        checkDepth(rt, *depth, view.subImage.imageRect);
}

void checkProjection(Runtime& rt, const Session& session, const XrCompositionLayerProjection& layer)
{
    rt.requireSpace(layer.space);
    const uint32_t expected = requireConfiguration(rt, session.configuration);
    if (layer.viewCount != expected)
        refuse(XR_ERROR_VALIDATION_FAILURE, formatString("viewCount %u, expected %u", layer.viewCount, expected));
    requirePointer(layer.views, "views");
    for (uint32_t i = 0; i < layer.viewCount; ++i)
        checkView(rt, layer.views[i], rt.settings.views[i]);
}

void checkQuad(Runtime& rt, const XrCompositionLayerQuad& layer)
{
    rt.requireSpace(layer.space);
    checkSubImage(rt, layer.subImage);
    if (!isUnit(layer.pose.orientation))
        refuse(XR_ERROR_POSE_INVALID, "a quad's pose has no unit quaternion");
}

} // namespace

void checkFrame(Runtime& rt, const Session& session, const XrFrameEndInfo& info)
{
    if (info.displayTime <= 0)
        refuse(XR_ERROR_TIME_INVALID, "displayTime is not more than 0");
    if (info.environmentBlendMode != XR_ENVIRONMENT_BLEND_MODE_OPAQUE)
        refuse(XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED,
               formatString("environmentBlendMode %d, expected OPAQUE", info.environmentBlendMode));
    if (info.layerCount > kMaxLayers)
        refuse(XR_ERROR_LAYER_LIMIT_EXCEEDED, formatString("%u layers, at most %u", info.layerCount, kMaxLayers));
    if (info.layerCount > 0 && (info.layers == nullptr || !session.gpu))
        refuse(XR_ERROR_LAYER_INVALID, "layers is null, or the session is headless");
    for (uint32_t i = 0; i < info.layerCount; ++i) {
        const XrCompositionLayerBaseHeader* layer = info.layers[i];
        if (layer == nullptr)
            refuse(XR_ERROR_LAYER_INVALID, formatString("layer %u is null", i));
        if (layer->type == XR_TYPE_COMPOSITION_LAYER_PROJECTION)
            checkProjection(rt, session, *reinterpret_cast<const XrCompositionLayerProjection*>(layer));
        else if (layer->type == XR_TYPE_COMPOSITION_LAYER_QUAD)
            checkQuad(rt, *reinterpret_cast<const XrCompositionLayerQuad*>(layer));
        else
            refuse(XR_ERROR_LAYER_INVALID, formatString("layer %u has type %d", i, layer->type));
    }
}

} // namespace gsc::fake_xr
