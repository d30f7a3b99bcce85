// SPDX-License-Identifier: Apache-2.0
// The kind of file that an output's name says.
#pragma once

#include <string>

namespace gsc {

// The ending of a path in lower case, with its point; "" without one.
[[nodiscard]] std::string endingOf(const std::string& path);

// Throws Error(Usage) if `output`, which becomes a .gsc file, is named as a file of another kind.
void checkGscName(const std::string& output);

} // namespace gsc
