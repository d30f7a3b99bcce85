// SPDX-License-Identifier: Apache-2.0
// What `gsc bake` says of files that it cut or joined.
#pragma once

#include "convert/bake/tiles/tiles.h"
#include "convert/commands/command.h"

#include <string>

namespace gsc {

Json tilesJson(const TileOptions& options, const TileReport& report);
std::string tilesText(const TileOptions& options, const TileReport& report);

} // namespace gsc
