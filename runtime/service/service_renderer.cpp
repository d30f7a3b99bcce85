// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/service_renderer.h"

#include <gsc/error.h>
#include "runtime/backend/frame_checks.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <optional>

namespace gsc {

namespace {

// Frames in flight for each worker beside the two that it draws, so that no worker waits if the caller is late.
constexpr uint32_t kFramesPerWorker = 3;

class SharedRenderer final : public ServiceRenderer {
public:
    explicit SharedRenderer(const ServiceOptions& options) : m_options(options)
    {
        m_options.keeps_all = true;
        m_options.timeout = ServiceTime(0);
        m_options.still_distance = m_options.still_degrees = 0;
    }

    [[nodiscard]] DeviceId id() const override { return m_id; }
    [[nodiscard]] DeviceFacts device() const override { return service().device(); }
    [[nodiscard]] bool onHost() const override
    {
        return std::ranges::all_of(m_options.devices,
                                   [](const DeviceId& device) { return device.backend.starts_with("cpu"); });
    }
    [[nodiscard]] bool takesDeviceTargets() const override { return onHost(); }
    [[nodiscard]] Tier tierOf(Tier asked) const override { return service().tierOf(asked); }
    [[nodiscard]] uint32_t framesInFlight() const override { return serviceFramesInFlight(m_options.devices.size()); }
    void load(const ModelView& model) override { start(model); }
    // Workers that hang keep the scene alive, too.
    void load(std::shared_ptr<const Scene> scene) override { start(std::move(scene)); }
    void dropCaches() override { service().dropCaches(); }

    uint64_t submit(const FrameRequest& request) override
    {
        (void)service();
        checkInFlight(m_flying.size(), framesInFlight());
        PoseRequest pose;
        pose.eyes.assign(request.eyes.begin(), request.eyes.end());
        pose.options = request.options;
        Flying flying;
        const bool any = std::ranges::any_of(
            request.targets, [](const FrameTarget& target) { return target.kind != FrameTarget::Kind::None; });
        pose.on_device = !any;
        for (const FrameTarget& target : request.targets) {
            if (target.kind == FrameTarget::Kind::Surface ||
                (target.kind == FrameTarget::Kind::Device && !takesDeviceTargets()) ||
                (any && target.format != request.targets.front().format))
                throw Error(ErrorCode::Unsupported, "target", "of several workers on a device, or of two formats",
                            "memory of this process and one format", "take pictures from a RendererService instead");
            pose.wants_depth = pose.wants_depth || target.hasDepth();
        }
        if (any)
            pose.format = request.targets.front().format;
        flying.targets.assign(request.targets.begin(), request.targets.end());
        for (const EyeParams& eye : request.eyes)
            flying.sizes.push_back({eye.width, eye.height});
        flying.ticket = m_service->submit(pose);
        return m_flying.emplace_back(std::move(flying)).ticket;
    }

    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        const auto found = std::ranges::find(m_flying, ticket, &Flying::ticket);
        if (found == m_flying.end())
            throwNotInFlight(ticket);
        const auto from = std::chrono::steady_clock::now();
        while (!found->delivery) { // pictures come in order, but the caller may wait for them in another order
            const auto passed = std::chrono::steady_clock::now() - from;
            std::optional<Delivery> next = m_service->next(std::max(most - passed, std::chrono::nanoseconds(0)));
            if (!next)
                return FrameState::Pending;
            std::ranges::find(m_flying, next->pose, &Flying::ticket)->delivery = std::move(*next);
        }
        const Flying flying = std::move(*found);
        m_flying.erase(found);
        if (flying.delivery->error)
            std::rethrow_exception(flying.delivery->error);
        result = flying.delivery->result;
        for (size_t e = 0; e < flying.targets.size(); ++e)
            copy(flying.delivery->eyes[e], flying.targets[e], flying.sizes[e].first, flying.sizes[e].second);
        return FrameState::Done;
    }

    [[nodiscard]] ServiceStats stats() const override { return service().stats(); }
    [[nodiscard]] ServiceTrace trace() const override { return service().trace(); }

private:
    RendererService& service()
    {
        if (!m_service)
            throw Error(ErrorCode::Usage, "renderer", "no model is loaded", "one", "call load() first");
        return *m_service;
    }
    [[nodiscard]] const RendererService& service() const { return const_cast<SharedRenderer*>(this)->service(); }

    template <typename Model>
    void start(Model&& model)
    {
        m_flying.clear();
        m_service.reset();
        m_service.emplace(std::forward<Model>(model), m_options);
        m_id = m_service->stats().workers.front().device;
    }

    struct Flying {
        uint64_t ticket = 0;
        std::vector<FrameTarget> targets;
        std::vector<std::pair<uint32_t, uint32_t>> sizes;
        std::optional<Delivery> delivery;
    };

    static void copy(const FrameTarget& from, const FrameTarget& to, uint32_t width, uint32_t height)
    {
        if (to.kind == FrameTarget::Kind::None)
            return;
        const size_t row = width * pixelBytes(from.format);
        for (uint32_t y = 0; y < height; ++y)
            std::memcpy(static_cast<std::byte*>(to.pixels) + y * pitchOf(to, width),
                        static_cast<const std::byte*>(from.pixels) + y * row, row);
        for (uint32_t y = 0; to.depth != nullptr && y < height; ++y)
            std::memcpy(reinterpret_cast<std::byte*>(to.depth) + y * depthPitchOf(to, width),
                        from.depth + size_t(y) * width, width * sizeof(float));
    }

    ServiceOptions m_options;
    DeviceId m_id;
    std::optional<RendererService> m_service;
    std::deque<Flying> m_flying;
};

} // namespace

uint32_t serviceFramesInFlight(size_t devices)
{
    return std::max(kFramesInFlight, kFramesPerWorker * uint32_t(devices));
}

std::unique_ptr<ServiceRenderer> makeServiceRenderer(const ServiceOptions& options)
{
    return std::make_unique<SharedRenderer>(options);
}

} // namespace gsc
