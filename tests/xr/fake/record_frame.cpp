// SPDX-License-Identifier: Apache-2.0
#include "submission.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace gsc::fake_xr {

namespace {

// The pixels of a view as submitted. Valid until the next view is read.
struct Picture {
    const std::byte* pixels;
    PixelFormat format;
    XrExtent2Di size;
};

std::string hashOf(const Picture& picture)
{
    uint64_t hash = 14695981039346656037ull; // FNV-1a
    const size_t bytes = size_t(picture.size.width) * size_t(picture.size.height) * picture.format.bytes;
    for (size_t i = 0; i < bytes; ++i)
        hash = (hash ^ uint64_t(picture.pixels[i])) * 1099511628211ull;
    return formatString("%016llx", static_cast<unsigned long long>(hash));
}

void writePpm(const std::string& path, const Picture& picture)
{
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr)
        throw std::runtime_error(path + ": the picture cannot be written");
    std::fprintf(file, "P6\n%d %d\n255\n", picture.size.width, picture.size.height);
    std::vector<std::byte> line(size_t(picture.size.width) * 3);
    const std::byte* from = picture.pixels;
    for (int y = 0; y < picture.size.height; ++y) {
        for (size_t x = 0; x < line.size(); x += 3, from += 4)
            for (size_t c = 0; c < 3; ++c)
                line[x + c] = from[picture.format.bgra ? 2 - c : c];
        std::fwrite(line.data(), 1, line.size(), file);
    }
    std::fclose(file);
}

void writeDepths(const std::string& path, const Picture& picture)
{
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr)
        throw std::runtime_error(path + ": the depths cannot be written");
    std::fwrite(picture.pixels, picture.format.bytes, size_t(picture.size.width) * size_t(picture.size.height), file);
    std::fclose(file);
}

const LocatedView* findLocated(const Session& session, uint32_t index, uint64_t space,
                               const XrCompositionLayerProjectionView& view)
{
    const std::deque<LocatedView>& list = session.located[index];
    const auto same = [&](const LocatedView& l) {
        return l.space == space && std::memcmp(&l.pose, &view.pose, sizeof l.pose) == 0 &&
               std::memcmp(&l.fov, &view.fov, sizeof l.fov) == 0;
    };
    const auto found = std::find_if(list.rbegin(), list.rend(), same);
    return found == list.rend() ? nullptr : &*found;
}

const char* spaceName(const Space& space)
{
    if (!space.reference)
        return "ACTION";
    return space.reference == XR_REFERENCE_SPACE_TYPE_VIEW    ? "VIEW"
           : space.reference == XR_REFERENCE_SPACE_TYPE_LOCAL ? "LOCAL"
                                                              : "STAGE";
}

// Nine digits tell any two floats apart.
std::string listOf(std::initializer_list<float> values)
{
    std::string text = "[";
    for (const float value : values)
        text += formatString("%s%.9g", text.size() > 1 ? "," : "", double(value));
    return text + "]";
}

std::string poseText(const XrPosef& pose)
{
    const auto& [q, p] = pose;
    return listOf({p.x, p.y, p.z, q.x, q.y, q.z, q.w});
}

std::string viewText(Runtime& rt, Session& session, const XrCompositionLayerProjection& layer, uint32_t index,
                     const std::string& picture_name)
{
    const XrCompositionLayerProjectionView& view = layer.views[index];
    const Swapchain& swapchain = rt.requireSwapchain(view.subImage.swapchain);
    const XrRect2Di& rect = view.subImage.imageRect;
    std::string text = R"({"pose":)" + poseText(view.pose);
    text += R"(,"fov":)" + listOf({view.fov.angleLeft, view.fov.angleRight, view.fov.angleUp, view.fov.angleDown});
    text += formatString(R"(,"space":"%s","rect":[%d,%d,%d,%d],"format":%lld)", spaceName(rt.requireSpace(layer.space)),
                         rect.offset.x, rect.offset.y, rect.extent.width, rect.extent.height,
                         static_cast<long long>(swapchain.info.format));
    if (const LocatedView* located = findLocated(session, index, idOf(layer.space), view))
        text += formatString(R"(,"located":%lld,"located_time":%lld)", static_cast<long long>(located->frame),
                             static_cast<long long>(located->time));
    else
        text += R"(,"located":null,"located_time":null)";
    const auto* depth = chained<XrCompositionLayerDepthInfoKHR>(view.next, XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR);
    text += R"(,"depth":)";
    if (depth == nullptr)
        text += "null";
    else if (std::isfinite(depth->nearZ) && std::isfinite(depth->farZ))
        text += formatString(R"({"near":%.9g,"far":%.9g})", double(depth->nearZ), double(depth->farZ));
    else // infinity is allowed for one of them, and JSON has none
        text += formatString(R"({"near":"%g","far":"%g"})", double(depth->nearZ), double(depth->farZ));
    if (depth != nullptr && !rt.settings.dump.empty()) {
        const Swapchain& depths = rt.requireSwapchain(depth->subImage.swapchain);
        const PixelFormat format = *pixelFormat(depths.info.format);
        const XrRect2Di& part = depth->subImage.imageRect;
        writeDepths(rt.settings.dump + "/" + picture_name + ".depth",
                    {session.gpu->read(depths.images[*depths.released], format, depth->subImage.imageArrayIndex, part),
                     format, part.extent});
    }
    std::string hash = "null";
    if (rt.settings.hash || !rt.settings.dump.empty()) {
        const PixelFormat format = *pixelFormat(swapchain.info.format);
        const Picture picture{
            session.gpu->read(swapchain.images[*swapchain.released], format, view.subImage.imageArrayIndex, rect),
            format, rect.extent};
        if (rt.settings.hash)
            hash = '"' + hashOf(picture) + '"';
        if (!rt.settings.dump.empty() && format.rgb8)
            writePpm(rt.settings.dump + "/" + picture_name + ".ppm", picture);
    }
    return text + R"(,"hash":)" + hash + "}";
}

} // namespace

void recordFrame(Runtime& rt, Session& session, const XrFrameEndInfo& info, int64_t missed)
{
    const Frame& frame = *session.begun;
    std::string views;
    int projections = 0;
    for (uint32_t i = 0; i < info.layerCount; ++i) {
        if (info.layers[i]->type != XR_TYPE_COMPOSITION_LAYER_PROJECTION)
            continue;
        const auto& layer = *reinterpret_cast<const XrCompositionLayerProjection*>(info.layers[i]);
        for (uint32_t v = 0; v < layer.viewCount; ++v) {
            std::string name = formatString("frame-%05lld-view-%u", static_cast<long long>(frame.number), v);
            if (projections > 0)
                name += formatString("-layer-%d", projections);
            views += (views.empty() ? "" : ",") + viewText(rt, session, layer, v, name);
        }
        ++projections;
    }
    rt.log.line(formatString(R"({"frame":%lld,"display_time":%lld,"predicted":%lld,"period":%lld,"should_render":%s,)"
                             R"("late":%s,"missed":%lld,"layers":%u,"views":[%s]})",
                             static_cast<long long>(frame.number), static_cast<long long>(info.displayTime),
                             static_cast<long long>(frame.predicted), static_cast<long long>(frame.period),
                             frame.should_render ? "true" : "false",
                             info.displayTime != frame.predicted ? "true" : "false", static_cast<long long>(missed),
                             info.layerCount, views.c_str()));
}

} // namespace gsc::fake_xr
