// SPDX-License-Identifier: Apache-2.0
// Libraries that start threads of their own often end the process, or wait for ever, where the system gives them none.
#pragma once

namespace gsc {

// From now on a thread that cannot be started, by any library of this process, ends it as an error does: it is tried again
// for a second, then message on standard error, with `json` the object of schemas/error.schema.json on standard output,
// temporary files removed, exit code 6. Threads of a ThreadAttempt (format/machine/threads.h) are left to who starts them.
void installThreadGuard(bool json, bool json_events);

} // namespace gsc
