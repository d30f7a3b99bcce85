// SPDX-License-Identifier: Apache-2.0
#include "player/measure/measurer.h"

#include <gsc/error.h>
#include "player/devices/open_renderer.h"
#include "runtime/devices/device_scorer.h"

namespace gsc {

namespace {

// True if a second renderer may stay open for the next path: it then need not load the model again.
bool leavesRoom(const Renderer& renderer)
{
    return renderer.onHost() || freeDeviceBytes(renderer.id()) > renderer.device().memory_bytes / 2;
}

} // namespace

Measurer::Measurer(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
                   std::string reference, const ScoreOptions& score, Reporter& log)
    : m_scene(std::move(scene)), m_model(model), m_choice(choice), m_reference(std::move(reference)), m_score(score),
      m_log(log)
{
}

Renderer& Measurer::renderer(const std::string& name, bool second)
{
    std::unique_ptr<Renderer>& slot = m_renderers[{name, second}];
    if (!slot) {
        // only the measured renderer draws on several devices
        const bool alone = second || (name == m_reference && name != m_measured);
        double ignored = 0;
        slot = openRenderer(m_model, alone ? m_choice.alone(name) : m_choice.of(name), m_scene, m_log, ignored);
    }
    return *slot;
}

std::string Measurer::nameOf(const std::string& name)
{
    if (name != "auto")
        return name;
    const std::string own = renderer(name).id().backend;
    m_measured = own;
    std::unique_ptr<Renderer>& slot = m_renderers[{own, false}];
    if (!slot)
        slot = std::move(m_renderers[{name, false}]);
    m_renderers.erase({name, false});
    return own;
}

std::string Measurer::deviceOf(const std::string& name)
{
    return renderer(name).device().name;
}

std::string Measurer::referenceOf(const std::string& name) const
{
    return m_reference.empty() ? name : m_reference;
}

// Renderer of the exact images. Without memory for two copies of the model the measured renderer is closed until its next run.
Renderer& Measurer::reference(const std::string& name, const std::string& measured)
{
    try {
        return renderer(name, true);
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory || m_renderers.erase({measured, false}) == 0)
            throw;
        return renderer(name, true);
    }
}

// Exact images of a path. A renderer on the host draws its own. On a GPU a second renderer does, because the memory that tier
// exact takes would stay and count as the run's.
ExactImages& Measurer::exactImages(const ExactOf& of, const FrameOptions& frame, const StepDone& done)
{
    const auto& [shown, name, measured] = of;
    const Path& path = *shown;
    if (m_exact && m_exact_of == of)
        return *m_exact;
    m_exact.reset(); // frees its memory for the next images
    if (m_exact_of.measured != measured)
        m_renderers.erase({m_exact_of.reference, true});
    const uint64_t bytes = ExactImages::bytes(path, m_score);
    const DeviceId scoring = renderer(measured).id();
    const bool on_host = renderer(measured).onHost(); // asked first: below, the measured renderer may be closed
    const bool own = on_host && name == measured && mayKeepOnHost(bytes);
    Renderer& drawing = own ? renderer(name) : reference(name, measured);
    std::shared_ptr<PictureMemory> memory = memoryToKeep(bytes, scoring, on_host, drawing);
    // a GPU draws an exact picture in less time than memory of the host takes to hold it
    const bool has_room = on_host || m_renderers.contains({measured, false});
    const bool kept =
        memory != nullptr && (drawing.onHost() || on_host || !has_room || memory->kind() == FrameTarget::Kind::Device);
    if (!kept)
        memory = memoryFor(scoring, on_host, drawing);
    auto exact = std::make_unique<ExactImages>(*m_scene, path, frame, m_score, drawing, std::move(memory));
    if (kept)
        exact->keepAll(done);
    else
        m_log.warning(formatString("%s: its exact images take %.1f GiB, too much to keep, and are rendered again for "
                                   "every run",
                                   path.cameras.c_str(), double(bytes) / double(1 << 30)));
    if (kept && !own && !leavesRoom(drawing))
        m_renderers.erase({name, true});
    m_exact = std::move(exact);
    m_exact_of = of;
    return *m_exact;
}

// Steps of runs that follow each other: exact images are drawn once for all runs in a row that need the same.
uint64_t Measurer::stepsOf(std::span<const Planned> runs) const
{
    uint64_t steps = 0;
    ExactOf drawn = m_exact ? m_exact_of : ExactOf();
    for (const Planned& run : runs) {
        const uint64_t frames = run.path->shots.size();
        const ExactOf exact = exactOf(run);
        steps += frames * kStepsOfFrame + (exact == drawn ? 0 : frames);
        drawn = exact;
    }
    return steps;
}

RunResult Measurer::run(std::span<const Planned> planned, const FrameOptions& frame)
{
    const Planned& run = planned.front();
    const uint64_t before = m_steps, total = before + stepsOf(planned);
    const uint64_t exact_drawn = before + stepsOf(planned.first(1)) - run.path->shots.size() * kStepsOfFrame;
    const auto progressFrom = [&](uint64_t first) {
        return [this, first, total](uint64_t steps) { m_log.progress("render", m_steps = first + steps, total); };
    };
    progressFrom(before)(0); // the time of loading the model counts too
    ExactImages& exact = exactImages(exactOf(run), frame, progressFrom(before));
    return measureRun(*m_scene, *run.path, frame, renderer(run.backend), exact, m_score, progressFrom(exact_drawn));
}

} // namespace gsc
