// SPDX-License-Identifier: Apache-2.0
// Lengths as a person types them, and the metre of a model.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gsc {

constexpr double kEyesApart = 0.064; // metres, if not stated; `gsc sample paths` takes the same

enum class LengthUnit { World, Metre };

struct Length {
    double value = 0; // 0 = not given
    LengthUnit unit = LengthUnit::World;
};

// "0.065" is a length in world units of the model; "0.064m", "6.4cm" and "64mm" are 0.064 metres. Throws Error(Usage),
// also for a length outside of 0 to 1e15; `option` is the name in its message.
Length parseLength(const std::string& text, const char* option);

// World units that stand for one metre of a viewer's body.
struct Metre {
    double units = 0;
    std::string rule; // how it was found, one sentence without a full stop
};

// Reads the metre of the manifest (/model/metre), which `gsc convert` wrote; none in older files or if it is no length.
std::optional<Metre> metreOfManifest(std::string_view manifest);

// metre.json beside a checkpoint: the metre of a model whose scale is known (schemas/metre.schema.json). `path` is used in
// messages. Throws Error(InvalidFile).
constexpr const char* kMetreFile = "metre.json";
Metre parseMetreFile(std::string_view text, const std::string& path);
std::string metreFileText(const Metre& metre);

} // namespace gsc
