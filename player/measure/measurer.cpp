// SPDX-License-Identifier: Apache-2.0
#include "player/measure/measurer.h"

#include "format/error.h"
#include "player/workers/open_renderer.h"

namespace gsc {

namespace {

constexpr uint64_t kKeptBytes = uint64_t(2) << 30; // of exact images; a longer path renders them for every run

} // namespace

Measurer::Measurer(std::shared_ptr<const Scene> scene, const PlayOptions& options, std::string reference, Reporter& log)
    : m_scene(std::move(scene)), m_options(options), m_reference(std::move(reference)), m_log(log)
{
}

Renderer& Measurer::renderer(const std::string& name, bool second)
{
    std::unique_ptr<Renderer>& slot = m_renderers[{name, second}];
    if (!slot) {
        PlayOptions options = m_options;
        options.backend = name;
        if (second || (name == m_reference && name != m_measured))
            options.workers = {}; // devices that draw together are what is measured
        double ignored = 0;
        slot = openRenderer(options, m_scene, m_log, ignored);
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

ExactImages& Measurer::exactImages(const Path& path, const std::string& reference, const FrameOptions& frame)
{
    if (m_exact && m_exact_path == &path && m_exact_reference == reference)
        return *m_exact;
    m_exact.reset(); // its memory is needed
    const bool fits = ExactImages::fit(path, kKeptBytes);
    auto exact = std::make_unique<ExactImages>(*m_scene, path, frame, renderer(reference, !fits));
    if (fits)
        exact->keepAll();
    else
        m_log.warning(formatString("%s: its exact images take more than 2 GiB and are rendered again for every run",
                                   path.cameras.c_str()));
    m_exact = std::move(exact);
    m_exact_path = &path;
    m_exact_reference = reference;
    return *m_exact;
}

RunResult Measurer::run(const Path& path, const std::string& name, const FrameOptions& frame, const ScoreOptions& score,
                        const FrameDone& done)
{
    ExactImages& exact = exactImages(path, referenceOf(name), frame);
    return measureRun(*m_scene, path, frame, renderer(name), exact, score, done);
}

} // namespace gsc
