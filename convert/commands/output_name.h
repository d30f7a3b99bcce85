// SPDX-License-Identifier: Apache-2.0
// The kind of file that an output's name says.
#pragma once

#include <string>

namespace gsc {

// Returns true for the ending of a kind of file that gsc makes of no model, such as ".splat".
[[nodiscard]] bool isForeignEnding(const std::string& ending);

// Throws Error(Usage) if `output`, which becomes a .gsc file, is named as a file of another kind.
void checkGscName(const std::string& output);

} // namespace gsc
