// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and other requests to end: long loops ask for them by throwIfInterrupted(), destructors clean up, and main
// returns 130.
#pragma once

namespace gsc {

// Catches SIGINT, SIGTERM and SIGHUP, unless they were ignored before; a second such signal ends the process at once.
// Ignores SIGPIPE and SIGXFSZ, so that writes fail instead.
void installInterruptHandler();
[[nodiscard]] bool interrupted() noexcept;
void throwIfInterrupted(); // throws Error(Interrupted) if such a signal has come

} // namespace gsc
