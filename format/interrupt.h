// SPDX-License-Identifier: Apache-2.0
// Ctrl-C: long loops ask, unwinding cleans up, main returns 130.
#pragma once

namespace gsc {

void installInterruptHandler(); // SIGINT and SIGTERM; a second signal kills at once
[[nodiscard]] bool interrupted() noexcept;
void throwIfInterrupted(); // throws Error(Interrupted)

} // namespace gsc
