// SPDX-License-Identifier: Apache-2.0
// A zip archive of stored members, as viewers in a browser unpack it: their sizes before them, no ZIP64.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// The archive's bytes; the members' dates are the first that a zip can say. Throws Error: Unsupported (2 GiB or more),
// OutOfMemory.
std::vector<std::byte> zipBundle(const std::vector<std::pair<std::string, std::vector<std::byte>>>& members);

} // namespace gsc
