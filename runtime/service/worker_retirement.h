// SPDX-License-Identifier: Apache-2.0
// When a worker is retired after a fault, and when it comes back. Called with the service's mutex held.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Is it what was asked for that cannot be drawn, by any worker? Then the pose fails, not the worker.
bool isOfRequest(const std::exception_ptr& error);

// A worker has thrown. Others draw what it was drawing. It comes back after a while, or is gone for good after too many
// faults (ServiceOptions::most_faults) or one that no time mends.
void retire(ServiceState& service, Worker& worker, const std::exception_ptr& error);

// True if a retired worker's time has come: it is as one that has not begun.
bool comesBack(ServiceState& service, Worker& worker);

// Retires workers that are in a call for longer than the deadline. A thread cannot be ended from outside: another worker,
// to be launched, takes the place of each.
[[nodiscard]] std::vector<WorkerPtr> replaceHanging(ServiceState& service);

} // namespace gsc
