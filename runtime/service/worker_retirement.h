// SPDX-License-Identifier: Apache-2.0
// Retirement of workers after a fault, and their return. The service's mutex must be held in every call.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// True if the error is about the request, which no worker could draw: then the pose fails, not the worker.
bool isOfRequest(const std::exception_ptr& error);

// Retires a worker that has thrown; others draw its parts. It comes back after a pause, or never after too many faults
// (ServiceOptions::most_faults) or one that waiting does not cure.
void retire(ServiceState& service, Worker& worker, const std::exception_ptr& error);

// True if a retired worker's pause is over: it is then Cold, as before its start.
bool comesBack(ServiceState& service, Worker& worker);

// Retires workers whose call takes longer than the deadline. A thread cannot be ended from outside, so a new worker takes
// the place of each. Returns the new workers, for the caller to launch.
[[nodiscard]] std::vector<WorkerPtr> replaceHanging(ServiceState& service);

} // namespace gsc
