// SPDX-License-Identifier: Apache-2.0
// What `gsc bake` says.
#pragma once

#include "convert/bake/bake.h"
#include "convert/commands/command.h"

#include <string>

namespace gsc {

Json bakeJson(const BakeOptions& options, const BakeReport& report);
std::string bakeText(const BakeOptions& options, const BakeReport& report);

} // namespace gsc
