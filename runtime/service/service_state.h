// SPDX-License-Identifier: Apache-2.0
// State that the callers of a service, its keeper and its workers' threads share. One mutex guards it; renderers are used
// without it, each by the thread of its worker alone (worker_thread.h).
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
    const std::shared_ptr<const Scene> scene; // null: `model` is the caller's
    const ModelView model;
    const ServiceClock clock;

    std::mutex mutex; // guards what follows
    std::condition_variable worker_wakes, caller_wakes, keeper_wakes;
    TraceRecord trace{options.trace_limit, clock};
    PoseQueue poses{options, clock, trace, caller_wakes};
    ServiceWorkers workers{options.devices, poses, trace, worker_wakes};
    Sharing sharing{options, clock, trace, poses, workers, worker_wakes};
    DeliveryMemory pictures;
    uint64_t drops = 0;       // calls of dropCaches()
    std::exception_ptr error; // the last fault
    bool stopping = false;

    struct First { // renderer that is ready
        DeviceFacts device;
        Tier exact = Tier::Exact, fast = Tier::Fast;
    };
    std::optional<First> first;
};

} // namespace gsc
