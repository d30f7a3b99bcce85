// SPDX-License-Identifier: Apache-2.0
// The thread of a worker: makes its renderer, takes parts, draws them, brings them to where pictures are delivered.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Starts the thread, which ends when the service stops or the worker is abandoned. A machine that gives no thread has one
// worker less. With the service's mutex held; the thread holds it but around what its renderer does.
void launch(const std::shared_ptr<ServiceState>& service, const WorkerPtr& worker);

} // namespace gsc
