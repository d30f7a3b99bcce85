// SPDX-License-Identifier: Apache-2.0
#include "player/devices/open_renderer.h"

#include <gsc/error.h>
#include "format/machine/threads.h"
#include "kernels/threads/stopwatch.h"
#include "player/model/converted_model.h"
#include "player/devices/worker_options.h"
#include "runtime/service/service_renderer.h"

#include <chrono>
#include <system_error>
#include <thread>

namespace gsc {

std::shared_ptr<const Scene> openScene(const ModelChoice& model, const DeviceChoice& choice, Reporter& log)
{
    convertModel(model.file, log);
    const WorkerOptions& workers = choice.workers;
    DeviceId first{choice.backend, choice.device};
    if (workers.several())
        first = !workers.devices.empty() ? workers.devices.front() : DeviceId{workers.count.on_cpu ? "cpu" : "cuda", 0};
    std::jthread start;
    try {
        const ThreadAttempt attempt;
        start = std::jthread([&first] { startDevice(first); });
    } catch (const std::system_error&) {
        // no thread could be started; starting the device early only saves time
    }
    return Scene::open(gscPath(model.file), model.verify);
}

std::unique_ptr<Renderer> openRenderer(const ModelChoice& model, const DeviceChoice& choice,
                                       std::shared_ptr<const Scene> scene, Reporter& log, double& load_ms)
{
    if (drawsWithService(choice)) {
        const ServiceOptions options = serviceOptions(model, choice, log);
        std::unique_ptr<Renderer> service = makeServiceRenderer(options);
        const auto start = std::chrono::steady_clock::now();
        service->load(std::move(scene));
        load_ms = millisecondsSince(start);
        return service;
    }
    std::vector<std::string> passed_over;
    std::unique_ptr<Renderer> renderer = makeLoadedRenderer(
        {choice.backend, choice.device}, {choice.threads, choice.vram_budget}, std::move(scene), passed_over, &load_ms);
    for (const std::string& text : passed_over)
        log.warning(text);
    return renderer;
}

} // namespace gsc
