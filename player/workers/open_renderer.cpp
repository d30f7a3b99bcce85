// SPDX-License-Identifier: Apache-2.0
#include "player/workers/open_renderer.h"

#include "format/error.h"
#include "player/workers/worker_options.h"
#include "runtime/service/service_renderer.h"

#include <chrono>
#include <thread>

namespace gsc {

namespace {

std::unique_ptr<Renderer> load(std::unique_ptr<Renderer> renderer, std::shared_ptr<const Scene> scene, double& load_ms)
{
    const auto start = std::chrono::steady_clock::now();
    renderer->load(std::move(scene));
    load_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return renderer;
}

// Is it the device that cannot, so that another may?
bool isOfDevice(ErrorCode code)
{
    return code == ErrorCode::OutOfMemory || code == ErrorCode::Unsupported || code == ErrorCode::Device;
}

} // namespace

std::shared_ptr<const Scene> openScene(const PlayOptions& options)
{
    const WorkerOptions& workers = options.workers;
    DeviceId first{options.backend, options.device};
    if (workers.several())
        first = !workers.devices.empty() ? workers.devices.front() : DeviceId{workers.count.on_cpu ? "cpu" : "cuda", 0};
    const std::jthread start([&first] { startDevice(first); });
    return Scene::open(options.input, options.verify);
}

std::unique_ptr<Renderer> openRenderer(const PlayOptions& options, std::shared_ptr<const Scene> scene, Reporter& log,
                                       double& load_ms)
{
    if (drawsWithService(options))
        return load(makeServiceRenderer(serviceOptions(options, log)), std::move(scene), load_ms);
    const RendererOptions limits{options.threads, options.vram_budget};
    std::string name = options.backend;
    try {
        std::string passed_over;
        const int ordinal = options.backend.starts_with("cpu") ? 0 : options.device; // which a reference may have
        std::unique_ptr<Renderer> renderer = makeRenderer({options.backend, ordinal}, limits, &passed_over);
        if (!passed_over.empty())
            log.warning(passed_over);
        name = renderer->id().backend;
        return load(std::move(renderer), scene, load_ms);
    } catch (const Error& e) {
        if (options.backend != "auto" || name == "cpu" || !isOfDevice(e.code()))
            throw;
        log.warning(formatString("backend %s is passed over: %s", name.c_str(), e.what()));
    }
    return load(makeRenderer({"cpu"}, limits), scene, load_ms);
}

} // namespace gsc
