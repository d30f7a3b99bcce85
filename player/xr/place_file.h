// SPDX-License-Identifier: Apache-2.0
// File of a viewer's start in a model: MODEL.gsc.place.json, beside the model (schemas/place.schema.json).
#pragma once

#include "runtime/cli/json.h"
#include "player/poses/placement.h"

#include <optional>
#include <string>

namespace gsc {

OrderedJson placeJson(const Placement& place); // without the schema's name

std::string placePath(const std::string& model);

// Returns none if there is no such file. Throws Error: Io, InvalidFile.
std::optional<Placement> readPlace(const std::string& model);
// Replaces an older file. Returns its path. Throws Error(Io).
std::string writePlace(const std::string& model, const Placement& place);

} // namespace gsc
