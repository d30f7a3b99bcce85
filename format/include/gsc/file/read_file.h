// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// A file as a whole, its byte order mark taken off (decodedText()); "-" is standard input. A pipe, such as a shell's <(COMMAND), is read to its end, and one that nobody
// writes to ends at once. `expected` is for messages, such as "a camera file". Throws Error: Io; InvalidFile for more
// than `most` bytes; Interrupted, also while it waits for a pipe; as refuseStandIn().
std::string readInputText(const std::string& path, uint64_t most, const char* expected);

} // namespace gsc
