// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// Reads a whole text file, or standard input for "-", without its byte order mark (decodedText()). A pipe, such as a
// shell's <(COMMAND), is read to its end; one that no program has opened for writing ends at once. `most`: largest
// allowed size in bytes; `expected`: words for messages, such as "a camera file". Throws Error: Io; InvalidFile for
// more than `most` bytes; Interrupted, also while it waits for a pipe; as refuseStandIn().
std::string readInputText(const std::string& path, uint64_t most, const char* expected);

} // namespace gsc
