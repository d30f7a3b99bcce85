// SPDX-License-Identifier: Apache-2.0
// A mapped file that another program cuts short, or whose disk fails, raises SIGBUS where it is read. A program turns
// that into a message and exit code 2; a library leaves the signal alone.
#pragma once

namespace gsc {

// From now on such a fault ends the process: message on standard error, with `json_events` as one of
// schemas/progress-event.schema.json, with `json` the object of schemas/error.schema.json on standard output too,
// temporary files removed, exit code 2. Any other SIGBUS gets what was installed before. May be called again.
void installFileFaultHandler(bool json, bool json_events);

} // namespace gsc
