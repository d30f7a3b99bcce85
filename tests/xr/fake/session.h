// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime.h"

namespace gsc::fake_xr {

// The settings' events up to this frame. May refuse the call, when the session or the instance is lost.
void playEvents(Runtime& rt, int64_t frame);
// The states after the first frame of a session that was begun.
void becomeFocused(Runtime& rt);
// Frame and swapchain calls belong to one thread, as the queue does. Reports another one, once for each function.
void watchThread(Runtime& rt, Session& session, const char* function);
void destroySession(Runtime& rt);

} // namespace gsc::fake_xr
