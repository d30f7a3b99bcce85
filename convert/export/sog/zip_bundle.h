// SPDX-License-Identifier: Apache-2.0
// Writes a zip archive of uncompressed files as viewers in browsers read it: with sizes before the contents, and
// without ZIP64.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Returns the bytes of the archive. All dates in it are the first that a zip can hold. Throws Error: Unsupported (2 GiB
// or more), OutOfMemory.
std::vector<std::byte> zipBundle(const std::vector<std::pair<std::string, std::vector<std::byte>>>& members);

} // namespace gsc
