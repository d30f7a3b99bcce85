// SPDX-License-Identifier: Apache-2.0
// Where a viewer's eyes start in a model, beside the model: MODEL.gsc.place.json (schemas/place.schema.json).
#pragma once

#include "runtime/cli/json.h"
#include "player/poses/placement.h"

#include <optional>
#include <string>

namespace gsc {

OrderedJson placeJson(const Placement& place); // without the schema's name

std::string placePath(const std::string& model);

// None where there is no such file. Throws Error: Io, InvalidFile.
std::optional<Placement> readPlace(const std::string& model);
// Its path. Takes the place of an older one. Throws Error(Io).
std::string writePlace(const std::string& model, const Placement& place);

} // namespace gsc
