// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/worker_retirement.h"

#include <gsc/error.h>
#include "kernels/threads/stopwatch.h"

#include <algorithm>
#include <utility>

namespace gsc {

namespace {

std::string textOf(const std::exception_ptr& error)
{
    try {
        std::rethrow_exception(error);
    } catch (const std::exception& e) {
        return e.what();
    } catch (...) {
        return "an unknown exception";
    }
}

// Counts a fault and sets the worker's pause, which has an upper limit. On a machine that is slower than the deadline
// every part is a fault; if `most_faults` allows many, nothing would be drawn for minutes otherwise.
void countFault(ServiceState& service, Worker& worker, const std::exception_ptr& error, const std::string& text,
                bool lasting)
{
    constexpr uint32_t kMostDoublings = 6;
    service.error = worker.fault = error;
    ++worker.stats.faults;
    worker.stats.last_fault = text;
    lasting = ++worker.faults_in_a_row >= service.options.most_faults || lasting;
    worker.state = lasting ? WorkerState::Gone : WorkerState::Retired;
    worker.returns =
        service.clock.now() + service.options.comes_back * (1 << std::min(worker.faults_in_a_row - 1, kMostDoublings));
    service.trace.note(TraceEvent::Kind::Retire, worker.index, text);
}

// Gives back the parts that `out` was drawing, and wakes the other workers to draw them.
void giveBack(ServiceState& service, Worker& out, const std::exception_ptr& error)
{
    service.poses.giveBack(std::exchange(out.jobs, {}), error);
    service.poses.freeParts(out.index);
    if (service.workers.allGone())
        service.poses.failWaiting(error);
    service.worker_wakes.notify_all();
    service.caller_wakes.notify_all();
    service.keeper_wakes.notify_all();
}

} // namespace

bool isOfRequest(const std::exception_ptr& error)
{
    try {
        std::rethrow_exception(error);
    } catch (const Error& e) {
        return e.code() == ErrorCode::Usage || e.code() == ErrorCode::Unsupported;
    } catch (...) {
        return false;
    }
}

void retire(ServiceState& service, Worker& worker, const std::exception_ptr& error)
{
    countFault(service, worker, error, textOf(error), isOfRequest(error));
    giveBack(service, worker, error);
}

bool comesBack(ServiceState& service, Worker& worker)
{
    if (worker.state != WorkerState::Retired || service.clock.now() < worker.returns)
        return false; // the pause is not over; the keeper will wake the worker later
    service.trace.note(TraceEvent::Kind::Return, worker.index, "after a fault");
    worker.state = WorkerState::Cold;
    return true;
}

std::vector<WorkerPtr> replaceHanging(ServiceState& service)
{
    std::vector<WorkerPtr> fresh;
    for (const WorkerPtr& hung : std::vector(service.workers.all())) {
        const bool draws = hung->state == WorkerState::Working;
        const ServiceTime deadline = draws ? service.options.deadline : service.options.load_deadline;
        if (!hung->in_call || deadline.count() <= 0 || service.clock.now() - *hung->in_call <= deadline)
            continue;
        const std::string text = formatString("hangs: %s took longer than %.0f ms",
                                              draws ? "a part" : "loading or letting go", milliseconds(deadline));
        const auto error = std::make_exception_ptr(
            Error(ErrorCode::Device, deviceText(hung->device), text, "less", "see whether the device still answers"));
        const WorkerPtr& other = fresh.emplace_back(std::make_shared<Worker>(hung->index, hung->device));
        other->draws = hung->draws;
        other->stats = hung->stats;
        other->faults_in_a_row = hung->faults_in_a_row;
        countFault(service, *other, error, text, false);
        hung->abandoned = true;
        service.workers.replace(other);
        giveBack(service, *hung, error);
    }
    return fresh;
}

} // namespace gsc
