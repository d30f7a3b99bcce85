// SPDX-License-Identifier: Apache-2.0
// The thread that looks after a service: it expires poses that wait too long, replaces workers that hang, and starts and
// stops workers to hold the rate.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Starts the thread, which ends after ServiceState::stopping is set. Throws std::system_error if the system gives no
// thread.
std::thread startKeeper(const std::shared_ptr<ServiceState>& service);

} // namespace gsc
