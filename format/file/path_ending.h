// SPDX-License-Identifier: Apache-2.0
// Tells kinds of files by their names.
#pragma once

#include <string>

namespace gsc {

// Returns the ending of a path in lower case, with its point; "" without one.
std::string endingOf(const std::string& path);

} // namespace gsc
