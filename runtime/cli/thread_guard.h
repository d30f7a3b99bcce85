// SPDX-License-Identifier: Apache-2.0
// Handles threads that cannot be started. Libraries that start threads of their own often end the process, or wait for
// ever, if the system has no more threads.
#pragma once

namespace gsc {

// After this call, if any library of this process cannot start a thread, it tries again for a second; then the process
// ends as with an error: message on standard error, with `json` an object of schemas/error.schema.json on standard
// output, temporary files removed, exit code 6. Threads of a ThreadAttempt (format/machine/threads.h) are left to the
// code that starts them.
void installThreadGuard(bool json, bool json_events);

} // namespace gsc
