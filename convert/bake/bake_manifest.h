// SPDX-License-Identifier: Apache-2.0
// Facts of a bake in the manifest of the baked file.
#pragma once

#include "convert/bake/bake.h"

#include <optional>
#include <string>
#include <string_view>

namespace gsc {

// JSON of the manifest's "reduction": levers, poses and measured loss. Equal input and options give equal text.
[[nodiscard]] std::string reductionText(const BakeReport& report, std::optional<double> target);
// KnownSource::facts of a file with this reduction, made from a file with this manifest.
[[nodiscard]] std::string reducedFacts(std::string_view manifest, const std::string& reduction);

} // namespace gsc
