// SPDX-License-Identifier: Apache-2.0
// State shared by the callers of a service, its keeper and its workers' threads. One mutex guards it; renderers are used
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
    const std::shared_ptr<const Scene> scene; // null: the caller owns `model`
    const ModelView model;
    const ServiceClock clock;

    std::mutex mutex; // guards the members below
    std::condition_variable worker_wakes, caller_wakes, keeper_wakes;
    TraceRecord trace{options.trace_limit, clock};
    PoseQueue poses{options, clock, trace, caller_wakes};
    ServiceWorkers workers{options.devices, poses, trace, worker_wakes};
    Sharing sharing{options, clock, trace, poses, workers, worker_wakes};
    DeliveryMemory pictures;
    uint64_t drops = 0;       // calls of dropCaches()
    std::exception_ptr error; // the last fault
    bool stopping = false;

    struct First { // facts of the first renderer that was ready
        DeviceFacts device;
        Tier exact = Tier::Exact, fast = Tier::Fast;
    };
    std::optional<First> first;
};

} // namespace gsc
