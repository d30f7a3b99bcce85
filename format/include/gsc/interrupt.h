// SPDX-License-Identifier: Apache-2.0
// Ctrl-C: long loops ask, unwinding cleans up, main returns 130.
#pragma once

namespace gsc {

// SIGINT, SIGTERM, SIGHUP, where not ignored before; a second kills at once. SIGPIPE, SIGXFSZ are ignored: writes fail.
void installInterruptHandler();
[[nodiscard]] bool interrupted() noexcept;
void throwIfInterrupted(); // throws Error(Interrupted)

} // namespace gsc
