// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/faulty_renderer.h"

#include <gsc/error.h>

#include <atomic>
#include <map>
#include <stdexcept>
#include <thread>
#include <utility>

namespace gsc {

namespace {

enum class Fault { None, Throw, Hang, Lost, Memory };

// Source of random faults, which all renderers of a worker use in turn: a new renderer must not fail at the same frame
// as the one before.
struct FaultSource {
    explicit FaultSource(const Faults& from) : faults(from) {}

    Fault next()
    {
        // splitmix64, a random number generator
        uint64_t bits = faults.seed * 0x9e3779b97f4a7c15u + ++drawn * 0xbf58476d1ce4e5b9u;
        bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
        bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
        double left = double((bits ^ (bits >> 31)) >> 11) / 9007199254740992.0;
        const std::pair<double, Fault> chances[] = {{faults.throws, Fault::Throw},
                                                    {faults.hangs, Fault::Hang},
                                                    {faults.lost, Fault::Lost},
                                                    {faults.memory, Fault::Memory}};
        for (const auto& [chance, fault] : chances) {
            if (left < chance)
                return fault;
            left -= chance;
        }
        return Fault::None;
    }

    const Faults faults;
    std::atomic<uint64_t> drawn = 0;
};

class FaultyRenderer final : public Renderer {
public:
    FaultyRenderer(std::unique_ptr<Renderer> renderer, std::shared_ptr<FaultSource> source)
        : m_renderer(std::move(renderer)), m_source(std::move(source))
    {
    }

    [[nodiscard]] DeviceId id() const override { return m_renderer->id(); }
    [[nodiscard]] DeviceFacts device() const override { return m_renderer->device(); }
    [[nodiscard]] bool onHost() const override { return m_renderer->onHost(); }
    [[nodiscard]] bool takesDeviceTargets() const override { return m_renderer->takesDeviceTargets(); }
    [[nodiscard]] DeviceCeilings ceilings() override { return m_renderer->ceilings(); }
    [[nodiscard]] Tier tierOf(Tier asked) const override { return m_renderer->tierOf(asked); }
    using Renderer::load;
    void load(const ModelView& model) override { m_renderer->load(model); }
    void dropCaches() override { m_renderer->dropCaches(); }
    [[nodiscard]] void* readyEvent(uint64_t ticket) const override { return m_renderer->readyEvent(ticket); }

    uint64_t submit(const FrameRequest& request) override
    {
        stayLost();
        const Fault fault = m_source->next();
        if (fault == Fault::Memory)
            throw Error(ErrorCode::OutOfMemory, deviceText(id()), "injected: no memory for a frame", "some",
                        "inject no fault")
                .with({Setting::InjectedFault});
        const uint64_t ticket = m_renderer->submit(request);
        m_faults[ticket] = fault;
        return ticket;
    }

    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        stayLost();
        const FrameState state = m_renderer->wait(ticket, result, most);
        if (state == FrameState::Pending)
            return state;
        const auto found = m_faults.extract(ticket);
        if (state != FrameState::Done) // the frame will be drawn again, and then counts as another one
            return state;
        const Fault fault = found ? found.mapped() : Fault::None;
        m_lost = fault == Fault::Lost;
        stayLost();
        if (fault == Fault::Throw)
            throw std::runtime_error("injected: an exception that nobody expects");
        if (fault == Fault::Hang) {
            std::this_thread::sleep_for(m_source->faults.hang);
            throw Error(ErrorCode::Device, deviceText(id()), "injected: answers only after a while", "sooner",
                        "inject no fault")
                .with({Setting::InjectedFault});
        }
        std::this_thread::sleep_for(m_source->faults.slow);
        return state;
    }

private:
    void stayLost() const
    {
        if (m_lost)
            throw Error(ErrorCode::Device, deviceText(id()), "injected: the device is lost", "it to be there",
                        "inject no fault")
                .with({Setting::InjectedFault});
    }

    std::unique_ptr<Renderer> m_renderer;
    std::shared_ptr<FaultSource> m_source;
    std::map<uint64_t, Fault> m_faults; // faults chosen for frames in flight, by ticket
    bool m_lost = false;
};

} // namespace

MakeRenderer withFaults(const Faults& faults, MakeRenderer make)
{
    auto source = std::make_shared<FaultSource>(faults);
    return [source, make = std::move(make)](const DeviceId& device, const RendererOptions& options) {
        std::unique_ptr<Renderer> made = make ? make(device, options) : makeRenderer(device, options);
        if (source->faults.device && *source->faults.device != device)
            return made;
        return std::unique_ptr<Renderer>(std::make_unique<FaultyRenderer>(std::move(made), source));
    };
}

} // namespace gsc
