// SPDX-License-Identifier: Apache-2.0
// Ctrl-C: long loops ask, unwinding cleans up, main returns 130.
#pragma once

namespace gsc {

// SIGINT, SIGTERM and SIGHUP; a second signal kills at once. SIGPIPE and SIGXFSZ are ignored: writes then fail.
void installInterruptHandler();
[[nodiscard]] bool interrupted() noexcept;
void throwIfInterrupted(); // throws Error(Interrupted)

} // namespace gsc
