// SPDX-License-Identifier: Apache-2.0
// Reports of `gsc bake`: on a bake, on a curve, on files that it cut or joined.
#pragma once

#include "convert/bake/bake.h"
#include "convert/bake/tiles/tiles.h"
#include "convert/commands/command.h"

#include <string>

namespace gsc {

// `packed`: the output is an archive.
Json bakeJson(const BakeOptions& options, const BakeReport& report, bool packed);
std::string bakeText(const BakeOptions& options, const BakeReport& report, bool packed);

// Lines of JSON (schemas/run.schema.json), one for each point of the curve. `name`: name of the model.
std::string curveLines(const std::string& name, const BakeOptions& options, const Curve& curve);
Json curveJson(const std::string& name, const BakeOptions& options, const std::string& output, const Curve& curve);
std::string curveText(const std::string& output, const Curve& curve);

Json tilesJson(const TileOptions& options, const TileReport& report);
std::string tilesText(const TileOptions& options, const TileReport& report);

} // namespace gsc
