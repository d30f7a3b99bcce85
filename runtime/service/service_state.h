// SPDX-License-Identifier: Apache-2.0
// State of a service that callers, the keeper and the workers' threads use. One mutex guards it. Renderers are used
// without the mutex, each only by the thread of its worker (worker_thread.h).
#pragma once

#include "runtime/service/delivery_memory.h"
#include "runtime/service/sharing.h"

namespace gsc {

struct ServiceState {
    ServiceState(std::shared_ptr<const Scene> of, const ModelView& view, const ServiceOptions& asked)
        : options(asked), scene(std::move(of)), model(view)
    {
    }

    const ServiceOptions options;
    const std::shared_ptr<const Scene> scene; // the scene that `model` belongs to; null: the caller keeps `model` alive
    const ModelView model;
    const ServiceClock clock;

    std::mutex mutex; // guards the members below
    std::condition_variable worker_wakes, caller_wakes, keeper_wakes;
    TraceRecord trace{options.trace_limit, clock};
    PoseQueue poses{options, clock, trace, caller_wakes};
    ServiceWorkers workers{options.devices, poses, trace, worker_wakes};
    Sharing sharing{options, clock, trace, poses, workers, worker_wakes};
    DeliveryMemory pictures;
    uint64_t drops = 0;       // number of calls of dropCaches()
    std::exception_ptr error; // error of the last fault
    bool stopping = false;

    struct First { // facts of the renderer that was ready first
        DeviceFacts device;
        Tier exact = Tier::Exact, fast = Tier::Fast;
    };
    std::optional<First> first;
};

} // namespace gsc
