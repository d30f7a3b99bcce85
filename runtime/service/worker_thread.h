// SPDX-License-Identifier: Apache-2.0
// The thread of a worker: makes a renderer, takes parts, draws them and copies them into the delivered picture.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Starts the thread, which ends when the service stops or the worker is abandoned. If the system gives no thread, the
// service has one worker less. The service's mutex must be held in this call; the thread holds it, too, except in
// calls of its renderer.
void launch(const std::shared_ptr<ServiceState>& service, const WorkerPtr& worker);

} // namespace gsc
