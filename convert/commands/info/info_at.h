// SPDX-License-Identifier: Apache-2.0
// Report of `gsc info --at X,Y,Z`.
#pragma once

#include "convert/commands/command.h"
#include <gsc/gsc_reader.h>

#include <array>
#include <string>

namespace gsc {

// Parses "X,Y,Z", three finite numbers. Throws Error(Usage) that names `option`.
std::array<double, 3> parsePoint(const std::string& option, const std::string& text);

// JSON and text of the report. Precondition of both: `view` came from openGsc() without errors. Both throw
// Error(InvalidFile) if the nodes of a grid are damaged.
Json atJson(const std::string& path, const GscView& view, const std::array<double, 3>& point);
std::string atText(const std::string& path, const GscView& view, const std::array<double, 3>& point);

} // namespace gsc
