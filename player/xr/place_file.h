// SPDX-License-Identifier: Apache-2.0
// The file of a viewer's start in a model: MODEL.gsc.place.json, beside the model (schemas/place.schema.json).
#pragma once

#include "runtime/cli/json.h"
#include "player/poses/placement.h"

#include <optional>
#include <string>

namespace gsc {

OrderedJson placeJson(const Placement& place); // the file's content, without the name of its schema

std::string placePath(const std::string& model);

// Reads the place file of the model at path `model`. Returns none if there is no such file. Throws Error: Io,
// InvalidFile.
std::optional<Placement> readPlace(const std::string& model);
// Writes the place file of the model at path `model`, replacing an older one. Returns its path. Throws Error(Io).
std::string writePlace(const std::string& model, const Placement& place);

} // namespace gsc
