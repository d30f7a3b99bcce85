// SPDX-License-Identifier: Apache-2.0
// Lengths as a person types them, and the metre of a model.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gsc {

// distance of the eyes in metres if none is stated, the same as in `gsc sample paths`
constexpr double kEyesApart = 0.064;

enum class LengthUnit { World, Metre };

struct Length {
    double value = 0; // length in the unit `unit`; 0 = not given
    LengthUnit unit = LengthUnit::World;
};

// Parses a length. "0.065" is in world units of the model; "0.064m", "6.4cm" and "64mm" are 0.064 metres. `option`
// names the option in messages. Throws Error(Usage), also if the length is not above 0 and below 1e15.
Length parseLength(const std::string& text, const char* option);

// Number of world units in one metre of a viewer's body.
struct Metre {
    double units = 0;
    std::string rule; // how the number was found: one sentence without a full stop
};

// Reads the metre that `gsc convert` wrote into the manifest (/model/metre). None in older files, or if the value is
// no length.
std::optional<Metre> metreOfManifest(std::string_view manifest);

// Name of the file beside a checkpoint that states the metre of the model (schemas/metre.schema.json). Its reader
// names `path` in messages and throws Error(InvalidFile).
constexpr const char* kMetreFile = "metre.json";
Metre parseMetreFile(std::string_view text, const std::string& path);
std::string metreFileText(const Metre& metre);

} // namespace gsc
