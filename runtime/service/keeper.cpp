// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/keeper.h"

#include "runtime/service/policy/pace.h"
#include "runtime/service/worker_retirement.h"
#include "runtime/service/worker_thread.h"

namespace gsc {

namespace {

constexpr auto kLook = std::chrono::milliseconds(5); // time between two looks at the service

void followPace(ServiceState& service, Pace& pace)
{
    PaceFacts facts;
    WorkerPtr ready, last;
    for (const WorkerPtr& worker : service.workers.all()) {
        if (worker->draws) {
            facts.working += !worker->isOut();
            facts.starting += worker->loads();
            if (worker->isReady())
                last = worker;
            continue;
        }
        const bool can = worker->state == WorkerState::Warm || worker->state == WorkerState::Cold;
        facts.ready += can;
        if (can && (ready == nullptr || (ready->state != WorkerState::Warm && worker->state == WorkerState::Warm)))
            ready = worker;
    }
    facts.rate = service.sharing.paceRate();
    facts.predicted_rate = service.sharing.foreseen(facts.rate);
    const PaceDecision decision = pace.look(service.clock.now(), facts);
    if (decision.step == PaceStep::Start && ready != nullptr)
        service.workers.order(*ready, true, decision.cause);
    if (decision.step == PaceStep::Stop && last != nullptr)
        service.workers.order(*last, false, decision.cause);
}

void keep(const std::shared_ptr<ServiceState>& shared)
{
    ServiceState& service = *shared;
    Pace pace(service.options.pace);
    std::unique_lock lock(service.mutex);
    while (!service.stopping) {
        service.keeper_wakes.wait_for(lock, kLook);
        service.poses.expire();
        for (const WorkerPtr& fresh : replaceHanging(service))
            launch(shared, fresh);
        followPace(service, pace);
        if (std::ranges::any_of(service.workers.all(), [&](const WorkerPtr& worker) {
                return worker->state == WorkerState::Retired && service.clock.now() >= worker->returns;
            }))
            service.worker_wakes.notify_all();
        service.workers.joinFinished();
    }
}

} // namespace

std::thread startKeeper(const std::shared_ptr<ServiceState>& service)
{
    return std::thread([service] { keep(service); });
}

} // namespace gsc
