// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime.h"

namespace gsc::fake_xr {

// Refuses a frame that breaks a rule.
void checkFrame(Runtime& rt, const Session& session, const XrFrameEndInfo& info);
// Logs a checked frame, and dumps its pictures where the settings say so.
void recordFrame(Runtime& rt, Session& session, const XrFrameEndInfo& info, int64_t missed);

} // namespace gsc::fake_xr
