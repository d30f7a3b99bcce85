// SPDX-License-Identifier: Apache-2.0
// Facts about a bake, as the manifest of the baked file states them.
#pragma once

#include "convert/bake/bake.h"

#include <optional>
#include <string>
#include <string_view>

namespace gsc {

// JSON text of the manifest's key "reduction": levers, poses and measured loss. Equal input and options give equal
// text.
[[nodiscard]] std::string reductionText(const BakeReport& report, std::optional<double> target);
// Value of KnownSource::facts for a baked file. `manifest`: that of the input; `reduction`: result of reductionText().
[[nodiscard]] std::string reducedFacts(std::string_view manifest, const std::string& reduction);

} // namespace gsc
