// SPDX-License-Identifier: Apache-2.0
#include "player/devices/frame_source.h"

#include "kernels/threads/stopwatch.h"
#include <gsc/error.h>
#include "player/devices/open_service.h"
#include "player/devices/worker_options.h"
#include "player/frames/lod_target.h"

#include <algorithm>

namespace gsc {

double DrawnPose::latencyMs() const
{
    return milliseconds(delivery.delivered - delivery.submitted);
}

FrameSource::FrameSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
                         SharedMemory& memory, OpenedService opened)
    : m_scene(std::move(scene)), m_opened(std::move(opened)), m_input(model.file)
{
    const DeviceId first = firstDevice(choice);
    if (memory.sharesMemory() && m_opened.devices.front() == deviceText(first))
        m_ring = std::make_unique<HandOverRing>(memory, first);
}

FrameSource::~FrameSource() = default;

bool FrameSource::drawsDetail(const FrameChoice& choice) const
{
    return gsc::drawsDetail(choice, stats().workers.front().device.backend, m_opened.service->tierOf(choice.tier));
}

uint64_t FrameSource::submit(const AskedPose& pose, const FrameOptions& options)
{
    EyeParams eyes[kMaxEyes];
    shotEyes(pose.shot, pose.eyes, eyes);
    PoseRequest request;
    request.eyes.assign(eyes, eyes + pose.eyes);
    request.options = options;
    request.options.appearance = shotAppearance(*m_scene, pose.shot);
    std::copy_n(&pose.gaze[0][0], 2 * kMaxEyes, &request.options.foveation.gaze[0][0]);
    std::ranges::copy(pose.lens, request.options.lens);
    request.format = pose.format;
    request.wants_depth = pose.wants_depth;
    request.on_device = m_ring != nullptr && pixelBytes(pose.format) == 4 && !pose.wants_depth;
    if (pose.late)
        request.late = [late = pose.late, shot = pose.shot, count = pose.eyes](std::span<EyeParams> latest) {
            Shot moved = shot;
            if (!late(moved))
                return false;
            shotEyes(moved, count, latest.data());
            return true;
        };
    const uint64_t number = m_opened.service->submit(request);
    AskedPose& asked = m_open.insert_or_assign(number, pose).first->second;
    asked.lod_bias = options.lod_bias;
    asked.detail = options.detail;
    asked.fovea_pixels = options.foveation.smallest;
    return number;
}

std::optional<DrawnPose> FrameSource::next(std::chrono::nanoseconds most)
{
    if (m_open.empty())
        return std::nullopt;
    std::optional<Delivery> delivery = m_opened.service->next(most);
    if (!delivery) {
        const ServiceStats stats = m_opened.service->stats();
        if (allGone(stats)) {
            const std::string why = stats.workers.empty() ? "" : stats.workers.back().last_fault;
            throw Error(ErrorCode::Device, m_input,
                        formatString("no worker is left%s%s", why.empty() ? "" : ", the last because: ", why.c_str()),
                        "one", "look at --list-devices and start again");
        }
        if (stats.counts.open() == 0) // no pose is open any more: the poses in m_open have expired or failed
            m_open.clear();
        return std::nullopt;
    }
    const auto asked = m_open.find(delivery->pose);
    if (asked == m_open.end())
        return std::nullopt;
    DrawnPose drawn{std::move(asked->second), std::move(*delivery)};
    m_open.erase(m_open.begin(), std::next(asked)); // poses older than the delivered one are late or expired
    return drawn;
}

std::vector<ShownPicture> FrameSource::shown(const DrawnPose& drawn)
{
    const FrameTarget* const eyes = drawn.delivery.eyes;
    const bool on_device = eyes[0].kind == FrameTarget::Kind::Device && m_ring != nullptr;
    if (on_device && m_handed_pose == drawn.delivery.pose)
        return m_handed;
    std::vector<ShownPicture> pictures;
    std::vector<const void*> from;
    uint32_t x = 0;
    for (uint32_t e = 0; e < drawn.asked.eyes; ++e) {
        ShownPicture& picture = pictures.emplace_back();
        const Shot& shot = drawn.asked.shot;
        const Camera& camera = e == 1 && shot.right_eye ? *shot.right_eye : shot.camera;
        picture.width = camera.width;
        picture.height = camera.height;
        picture.x = x;
        picture.pixels = static_cast<const std::byte*>(eyes[e].pixels);
        picture.depth = eyes[e].depth;
        from.push_back(eyes[e].pixels);
        x += picture.width;
    }
    if (eyes[0].kind == FrameTarget::Kind::Device && m_ring == nullptr)
        return {};
    if (on_device) {
        try {
            m_ring->handOver(pictures, from);
        } catch (const Error& e) {
            if (e.code() != ErrorCode::Device)
                throw;
            m_ring.reset(); // frees the memory on the device, too, so that the service can open the device again
            return {};
        }
        m_handed = pictures;
        m_handed_pose = drawn.delivery.pose;
    }
    return pictures;
}

} // namespace gsc
