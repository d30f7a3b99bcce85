// SPDX-License-Identifier: Apache-2.0
// What a baked file says of itself.
#pragma once

#include "convert/reduce/reduce.h"

#include <string>

namespace gsc {

// JSON of the manifest's "reduction": levers, poses and measured loss. The same for the same input and options.
[[nodiscard]] std::string reductionText(const ReduceReport& report, const ReduceOptions& options);

} // namespace gsc
