// SPDX-License-Identifier: Apache-2.0
// What `gsc bake` says.
#pragma once

#include "convert/commands/command.h"
#include "convert/reduce/reduce.h"

#include <string>

namespace gsc {

Json bakeJson(const ReduceOptions& options, const ReduceReport& report);
std::string bakeText(const ReduceOptions& options, const ReduceReport& report);

} // namespace gsc
