// SPDX-License-Identifier: Apache-2.0
#include "player/xr/view_source.h"

#include <gsc/error.h>

namespace gsc {

ViewSource::ViewSource(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
                       SharedMemory& memory, bool waits, size_t views, Reporter& log)
    : m_scene(std::move(scene)), m_model(model), m_choice(choice), m_memory(memory), m_waits(waits),
      m_keeps_all(waits || views > kMaxEyes), m_log(log)
{
    m_source = std::make_unique<FrameSource>(m_scene, m_model, m_choice, m_memory, opener()());
}

std::function<OpenedService()> ViewSource::opener() const
{
    return [scene = m_scene, model = m_model, choice = m_choice, keeps_all = m_keeps_all, &log = m_log] {
        return openService(
            scene, model, choice, [&](ServiceOptions& service) { service.keeps_all = keeps_all; }, log);
    };
}

// Opens a new renderer in a thread of its own, because releasing a device and loading a model take seconds.
void ViewSource::renew(const Error& why)
{
    if (++m_tries > kTries)
        throw why;
    m_log.warning(formatString("%s; it is made anew", why.what()));
    ++m_renewals;
    m_open.clear();
    OpenedService old = m_source ? m_source->release() : OpenedService{};
    m_source.reset(); // released in this thread, because it holds memory of the headset's Vulkan device
    m_opening = std::async(std::launch::async, [old = std::move(old), open = opener()]() mutable {
        old.service.reset();
        return open();
    });
}

bool ViewSource::submit(AskedViews views, const FrameOptions& options)
{
    if (!m_source || (m_keeps_all && !m_open.empty()))
        return false;
    uint64_t last = 0;
    for (const AskedPose& pair : views.pairs)
        last = m_source->submit(pair, options);
    m_open.insert_or_assign(last, Open{{std::move(views), {}}, nullptr});
    return true;
}

void ViewSource::take(DrawnPose drawn)
{
    const auto of = m_open.lower_bound(drawn.delivery.pose); // the poses of one frame have consecutive numbers
    if (of == m_open.end())
        return;
    Open& open = of->second;
    if (drawn.delivery.error)
        open.error = drawn.delivery.error;
    open.views.pairs.push_back(std::move(drawn));
    if (open.views.pairs.size() < open.views.asked.pairs.size())
        return;
    const std::exception_ptr error = open.error;
    if (!error)
        m_newest = std::move(open.views);
    m_open.erase(m_open.begin(), std::next(of)); // older frames are late or expired
    if (error && m_waits)
        std::rethrow_exception(error);
    m_tries = error ? m_tries : 0;
}

std::optional<DrawnViews> ViewSource::next(std::chrono::nanoseconds most)
{
    if (m_opening.valid()) {
        if (m_opening.wait_for(most) != std::future_status::ready)
            return std::nullopt;
        try {
            m_source = std::make_unique<FrameSource>(m_scene, m_model, m_choice, m_memory, m_opening.get());
        } catch (const Error& e) {
            renew(e);
        }
        return std::nullopt;
    }
    m_newest.reset();
    try {
        const auto until = std::chrono::steady_clock::now() + most;
        do {
            const auto left = std::max(until - std::chrono::steady_clock::now(), std::chrono::nanoseconds(0));
            std::optional<DrawnPose> drawn = m_source->next(m_newest ? std::chrono::nanoseconds(0) : left);
            if (drawn)
                take(std::move(*drawn));
            else if (m_newest || std::chrono::steady_clock::now() >= until)
                break;
        } while (m_source->waiting());
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Device || !allGone(m_source->stats()))
            throw;
        renew(e);
        return std::nullopt;
    }
    if (!m_source->waiting())
        m_open.clear(); // the poses that are left have failed or expired
    return std::exchange(m_newest, std::nullopt);
}

std::vector<ShownPicture> ViewSource::shown(const DrawnViews& drawn)
{
    std::vector<ShownPicture> all;
    for (const DrawnPose& pair : drawn.pairs) {
        const std::vector<ShownPicture> pictures = m_source->shown(pair);
        all.insert(all.end(), pictures.begin(), pictures.end());
    }
    return all;
}

std::optional<ServiceStats> ViewSource::stats() const
{
    return m_source ? std::optional(m_source->stats()) : std::nullopt;
}

} // namespace gsc
