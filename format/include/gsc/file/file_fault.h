// SPDX-License-Identifier: Apache-2.0
// A mapped file that another program cuts short, or whose disk fails, raises the signal SIGBUS where it is read. A
// program turns that into a message and exit code 2; the library does not change what the signal does.
#pragma once

namespace gsc {

// Installs the handler: from now on such a fault ends the process with exit code 2, a message on standard error, and
// temporary files removed. With `json_events` the message is a JSON object as in schemas/progress-event.schema.json;
// with `json` one as in schemas/error.schema.json is also written to standard output. Any other SIGBUS goes to the
// handler that was installed before. May be called again.
void installFileFaultHandler(bool json, bool json_events);

} // namespace gsc
