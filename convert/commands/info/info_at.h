// SPDX-License-Identifier: Apache-2.0
// Output of `gsc info --at X,Y,Z`.
#pragma once

#include "convert/commands/command.h"
#include <gsc/gsc_reader.h>

#include <array>
#include <string>

namespace gsc {

// Three finite numbers with commas between them. Throws Error(Usage) that names `option`.
std::array<double, 3> parsePoint(const std::string& option, const std::string& text);

// Precondition of both: `view` came from openGsc() without errors. Throw Error(InvalidFile): a grid cannot be walked.
Json atJson(const std::string& path, const GscView& view, const std::array<double, 3>& point);
std::string atText(const std::string& path, const GscView& view, const std::array<double, 3>& point);

} // namespace gsc
