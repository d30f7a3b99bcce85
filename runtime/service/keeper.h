// SPDX-License-Identifier: Apache-2.0
// The thread that looks after a service: poses that wait for too long, workers that hang, workers that start and stop with
// the rate.
#pragma once

#include "runtime/service/service_state.h"

namespace gsc {

// Ends after ServiceState::stopping. Throws std::system_error where the machine gives no thread.
std::thread startKeeper(const std::shared_ptr<ServiceState>& service);

} // namespace gsc
