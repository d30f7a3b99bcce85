// SPDX-License-Identifier: Apache-2.0
// What `gsc bake --curve` writes and says.
#pragma once

#include "convert/commands/command.h"

#include <string>

namespace gsc {

// Lines of gsc.curve/1, one for each point. `name` is the model's.
std::string curveLines(const std::string& name, const BakeOptions& options, const Curve& curve);
Json curveJson(const std::string& name, const BakeOptions& options, const std::string& output, const Curve& curve);
std::string curveText(const std::string& output, const Curve& curve);

} // namespace gsc
