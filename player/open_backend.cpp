// SPDX-License-Identifier: Apache-2.0
#include "player/open_backend.h"

#include "format/error.h"

#include <chrono>

namespace gsc {

namespace {

std::unique_ptr<Backend> load(std::unique_ptr<Backend> backend, const PlayOptions& options, const Scene& scene,
                              double& load_ms)
{
    backend->setMemoryBudget(options.vram_budget);
    const auto start = std::chrono::steady_clock::now();
    backend->load(scene.view());
    load_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return backend;
}

// Is it the device that cannot, so that another may?
bool isOfDevice(ErrorCode code)
{
    return code == ErrorCode::OutOfMemory || code == ErrorCode::Unsupported || code == ErrorCode::Device;
}

} // namespace

std::unique_ptr<Backend> openBackend(const PlayOptions& options, const Scene& scene, Reporter& log, double& load_ms)
{
    std::string name = options.backend;
    try {
        std::string passed_over;
        std::unique_ptr<Backend> backend = makeBackend(options.backend, options.threads, &passed_over);
        if (!passed_over.empty())
            log.warning(passed_over);
        name = backend->name();
        return load(std::move(backend), options, scene, load_ms);
    } catch (const Error& e) {
        if (options.backend != "auto" || name == "cpu" || !isOfDevice(e.code()))
            throw;
        log.warning(formatString("backend %s is passed over: %s", name.c_str(), e.what()));
    }
    return load(makeBackend("cpu", options.threads), options, scene, load_ms);
}

} // namespace gsc
