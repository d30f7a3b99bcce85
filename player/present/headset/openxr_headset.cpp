// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_actions.h"
#include "player/present/headset/xr_masks.h"
#include "player/present/headset/xr_runtime.h"
#include "player/present/headset/xr_swapchains.h"
#include "runtime/module/load_module.h"

#include <gsc/error.h>

#include <algorithm>
#include <utility>

namespace gsc {

namespace {

std::string formatName(int64_t format)
{
    switch (format) {
    case VK_FORMAT_R8G8B8A8_SRGB:
        return "R8G8B8A8_SRGB";
    case VK_FORMAT_B8G8R8A8_SRGB:
        return "B8G8R8A8_SRGB";
    case VK_FORMAT_R8G8B8A8_UNORM:
        return "R8G8B8A8_UNORM";
    case VK_FORMAT_B8G8R8A8_UNORM:
        return "B8G8R8A8_UNORM";
    case VK_FORMAT_D32_SFLOAT:
        return "D32_SFLOAT";
    default:
        return formatString("format %lld of Vulkan", static_cast<long long>(format));
    }
}

class OpenXrHeadset final : public Headset {
public:
    explicit OpenXrHeadset(const HeadsetOptions& options) : m_runtime(options)
    {
        try {
            m_blocks = std::make_unique<SharedBlocks>(*m_runtime.device);
            m_actions = std::make_unique<XrActions>(m_runtime.instance, m_runtime.tracks_gaze);
            makeSession();
            makeSpace(options.stage);
            m_actions->attach(m_session);
            m_masks = std::make_unique<XrMasks>(m_runtime, m_session);
            listFormats();
        } catch (...) {
            if (options.known != nullptr)
                *options.known = m_runtime.facts;
            destroy();
            throw;
        }
    }

    ~OpenXrHeadset() override { destroy(); }

    [[nodiscard]] const HeadsetFacts& facts() const override { return m_runtime.facts; }
    [[nodiscard]] bool sharesMemory() const override { return m_runtime.device->shares; }
    SharedBlock makeShared(size_t bytes) override { return m_blocks->make(bytes); }
    int semaphoreFile() override { return m_blocks->semaphoreFile(); }
    void importerGone() override { m_blocks->unblock(); }
    void freeShared(uint32_t id) override
    {
        finish();
        m_blocks->free(id);
    }

    void prepare() override
    {
        if (m_runtime.facts.format.empty()) {
            std::string offers;
            for (const std::string& name : m_runtime.facts.formats)
                offers += (offers.empty() ? "" : ", ") + name;
            throw Error(ErrorCode::Unsupported, "headset", "the OpenXR runtime takes pictures as " + offers,
                        formatString("%s or %s among them", formatName(kHeadsetFormats[0].format).c_str(),
                                     formatName(kHeadsetFormats[1].format).c_str()),
                        "update it, or use another runtime");
        }
        m_chains = std::make_unique<XrSwapchains>(m_runtime, m_session);
    }

    HeadsetState poll() override
    {
        for (;;) {
            auto event = xrInfo<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
            const XrResult result = xrPollEvent(m_runtime.instance, &event);
            if (result == XR_ERROR_INSTANCE_LOST)
                m_state = HeadsetState::Lost;
            else
                checkXr(result, "xrPollEvent");
            if (result != XR_SUCCESS)
                return m_state;
            if (event.type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING)
                m_state = HeadsetState::Lost;
            else if (event.type == XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING)
                m_moved = true;
            else if (event.type == XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR)
                m_masks->follow(reinterpret_cast<const XrEventDataVisibilityMaskChangedKHR&>(event));
            else if (event.type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED)
                follow(reinterpret_cast<const XrEventDataSessionStateChanged&>(event).state);
        }
    }

    bool spaceMoved() override { return std::exchange(m_moved, false); }
    [[nodiscard]] const HiddenMesh& hidden(size_t view) const override { return m_masks->of(view); }
    bool hiddenChanged() override { return m_masks->changed(); }

    void requestExit() override
    {
        if (m_state == HeadsetState::Running)
            checkXr(xrRequestExitSession(m_session), "xrRequestExitSession");
        else if (m_state == HeadsetState::Idle) // the session has not begun, so it cannot be asked to end
            m_state = HeadsetState::Over;
    }

    int64_t now() override
    {
        timespec machine{};
        XrTime time = 0;
        if (!m_runtime.has(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME) ||
            clock_gettime(CLOCK_MONOTONIC, &machine) != 0 ||
            XR_FAILED(xrFunction<PFN_xrConvertTimespecTimeToTimeKHR>(
                m_runtime.instance, "xrConvertTimespecTimeToTimeKHR")(m_runtime.instance, &machine, &time)))
            return 0;
        return time;
    }

    HeadsetFrame beginFrame() override
    {
        auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
        checkXr(xrWaitFrame(m_session, nullptr, &state), "xrWaitFrame");
        checkXr(xrBeginFrame(m_session, nullptr), "xrBeginFrame");
        m_display_time = state.predictedDisplayTime;
        return {state.predictedDisplayTime, state.predictedDisplayPeriod, state.shouldRender == XR_TRUE};
    }

    bool locate(int64_t time, std::vector<SpaceEye>& eyes) override
    {
        auto info = xrInfo<XrViewLocateInfo>(XR_TYPE_VIEW_LOCATE_INFO);
        info.viewConfigurationType = m_runtime.configuration;
        info.displayTime = time;
        info.space = m_space;
        auto state = xrInfo<XrViewState>(XR_TYPE_VIEW_STATE);
        std::vector<XrView> views(m_runtime.facts.views.size(), xrInfo<XrView>(XR_TYPE_VIEW));
        uint32_t count = 0;
        checkXr(xrLocateViews(m_session, &info, &state, uint32_t(views.size()), &count, views.data()), "xrLocateViews");
        constexpr XrViewStateFlags kValid = XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
        if ((state.viewStateFlags & kValid) != kValid || count != views.size())
            return false;
        eyes.clear();
        for (const XrView& view : views)
            eyes.push_back({poseOf(view.pose), double(view.fov.angleLeft), double(view.fov.angleRight),
                            double(view.fov.angleUp), double(view.fov.angleDown)});
        return true;
    }

    HeadsetInput input(int64_t time) override { return m_actions->read(m_session, m_space, time); }

    void take(const HeadsetPictures& pictures) override
    {
        m_chains->take(pictures, *m_blocks);
        m_shown.clear();
        for (size_t view = 0; view < pictures.eyes.size(); ++view) {
            const SpaceEye& eye = pictures.eyes[view];
            auto each = xrInfo<XrCompositionLayerProjectionView>(XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW);
            each.pose = xrPose(eye.pose);
            each.fov = {float(eye.left), float(eye.right), float(eye.up), float(eye.down)};
            each.subImage = m_chains->image(view);
            each.next = m_chains->depth(view);
            m_shown.push_back(each);
        }
    }

    void endFrame(bool shows) override
    {
        auto layer = xrInfo<XrCompositionLayerProjection>(XR_TYPE_COMPOSITION_LAYER_PROJECTION);
        layer.space = m_space;
        layer.viewCount = uint32_t(m_shown.size());
        layer.views = m_shown.data();
        const auto* const layers = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer);
        auto info = xrInfo<XrFrameEndInfo>(XR_TYPE_FRAME_END_INFO);
        info.displayTime = m_display_time;
        info.environmentBlendMode = m_runtime.blend;
        info.layerCount = shows && !m_shown.empty() ? 1 : 0;
        info.layers = &layers;
        checkXr(xrEndFrame(m_session, &info), "xrEndFrame");
    }

    void finish() override
    {
        if (m_chains)
            m_chains->wait();
    }

    [[nodiscard]] double copyMs() const override { return m_chains ? m_chains->copyMs() : 0; }

private:
    void makeSession()
    {
        auto binding = xrInfo<XrGraphicsBindingVulkan2KHR>(XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR);
        binding.instance = m_runtime.device->instance;
        binding.physicalDevice = m_runtime.device->physical;
        binding.device = m_runtime.device->handle;
        binding.queueFamilyIndex = m_runtime.device->family;
        auto info = xrInfo<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO, &binding);
        info.systemId = m_runtime.system;
        checkXr(xrCreateSession(m_runtime.instance, &info, &m_session), "xrCreateSession");
    }

    void makeSpace(bool stage)
    {
        const auto offered = xrList("xrEnumerateReferenceSpaces", XrReferenceSpaceType{},
                                    [this](uint32_t n, uint32_t* count, XrReferenceSpaceType* items) {
                                        return xrEnumerateReferenceSpaces(m_session, n, count, items);
                                    });
        for (const XrReferenceSpaceType type : offered)
            if (type == XR_REFERENCE_SPACE_TYPE_LOCAL || type == XR_REFERENCE_SPACE_TYPE_STAGE)
                m_runtime.facts.spaces.emplace_back(type == XR_REFERENCE_SPACE_TYPE_LOCAL ? "local" : "stage");
        if (stage && std::ranges::find(offered, XR_REFERENCE_SPACE_TYPE_STAGE) == offered.end())
            throw Error(ErrorCode::Unsupported, "headset", "the OpenXR runtime knows no floor",
                        "that a room was set up", "do so, or pass --xr-space local");
        auto info = xrInfo<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
        info.referenceSpaceType = stage ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
        info.poseInReferenceSpace.orientation.w = 1;
        checkXr(xrCreateReferenceSpace(m_session, &info, &m_space), "xrCreateReferenceSpace");
    }

    void listFormats()
    {
        const auto offered =
            xrList("xrEnumerateSwapchainFormats", int64_t{0}, [this](uint32_t n, uint32_t* count, int64_t* items) {
                return xrEnumerateSwapchainFormats(m_session, n, count, items);
            });
        for (const int64_t format : offered) {
            m_runtime.facts.formats.push_back(formatName(format));
            if (format == kDepthFormat)
                m_runtime.facts.takes_depth = m_runtime.has(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
        }
        for (const HeadsetFormat& known : kHeadsetFormats)
            if (std::ranges::find(offered, int64_t(known.format)) != offered.end()) {
                m_runtime.facts.format = formatName(known.format);
                m_runtime.facts.pixels = known.pixels;
                return;
            }
    }

    void follow(XrSessionState state)
    {
        if (m_state == HeadsetState::Lost || m_state == HeadsetState::Over)
            return; // later events do not matter once the session is lost
        switch (state) {
        case XR_SESSION_STATE_READY: {
            auto info = xrInfo<XrSessionBeginInfo>(XR_TYPE_SESSION_BEGIN_INFO);
            info.primaryViewConfigurationType = m_runtime.configuration;
            checkXr(xrBeginSession(m_session, &info), "xrBeginSession");
            m_state = HeadsetState::Running;
            break;
        }
        case XR_SESSION_STATE_STOPPING:
            checkXr(xrEndSession(m_session), "xrEndSession");
            m_state = HeadsetState::Idle;
            break;
        case XR_SESSION_STATE_EXITING:
            m_state = HeadsetState::Over;
            break;
        case XR_SESSION_STATE_LOSS_PENDING:
            m_state = HeadsetState::Lost;
            break;
        default:
            break; // beginFrame() tells whether pictures are wanted, not this state
        }
    }

    // Destroys the session and everything made for it. Errors are ignored, because nothing can be done about them
    // here.
    void destroy()
    {
        if (m_blocks)
            m_blocks->unblock();
        m_chains.reset();
        if (m_space != XR_NULL_HANDLE)
            xrDestroySpace(m_space);
        if (m_session != XR_NULL_HANDLE)
            xrDestroySession(m_session);
        m_actions.reset();
        m_blocks.reset();
    }

    XrRuntime m_runtime;
    std::unique_ptr<SharedBlocks> m_blocks;
    std::unique_ptr<XrActions> m_actions;
    std::unique_ptr<XrMasks> m_masks;
    XrSession m_session = XR_NULL_HANDLE;
    XrSpace m_space = XR_NULL_HANDLE;
    std::unique_ptr<XrSwapchains> m_chains;
    std::vector<XrCompositionLayerProjectionView> m_shown;
    HeadsetState m_state = HeadsetState::Idle;
    bool m_moved = false;
    XrTime m_display_time = 0;
};

std::unique_ptr<Headset> openHeadset(const HeadsetOptions& options)
{
    return std::make_unique<OpenXrHeadset>(options);
}

const HeadsetFunctions kFunctions = {openHeadset};

} // namespace

GSC_EXPORT_MODULE(kFunctions)

} // namespace gsc
