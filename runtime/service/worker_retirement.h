// SPDX-License-Identifier: Apache-2.0
// Retires workers after a fault, and lets them come back. The service's mutex must be held in every call.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Returns true if the error is about the request, so that no worker could draw it: then the pose fails, not the
// worker.
bool isOfRequest(const std::exception_ptr& error);

// Retires a worker that has thrown; others draw its parts. It comes back after a pause, but not after too many faults
// (ServiceOptions::most_faults) or one that waiting does not cure.
void retire(ServiceState& service, Worker& worker, const std::exception_ptr& error);

// Returns true if the pause of a retired worker is over: it is then Cold, as before its start.
bool comesBack(ServiceState& service, Worker& worker);

// Retires workers whose call takes longer than the deadline. A thread cannot be ended from outside, so a new worker
// takes the place of each. Returns the new workers, which the caller must launch.
[[nodiscard]] std::vector<WorkerPtr> replaceHanging(ServiceState& service);

} // namespace gsc
