// SPDX-License-Identifier: Apache-2.0
// Manifest of a file that was cut from another or joined from several.
#pragma once

#include "convert/bake/tiles/tiles.h"
#include <gsc/gsc_layout.h>

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct TileFacts {
    std::vector<std::string_view> manifests; // manifests of the input files
    bool one_model = false;                  // all input files were cut from one model
    uint64_t source_hash = 0;
    std::optional<TileRecord> tile; // the model that the file was cut from, and its rows
    std::optional<CropBox> box;
};

// Value of KnownSource::facts for the file. A model that was cut and joined completely again gets its old facts.
[[nodiscard]] std::string tileFactsText(const TileFacts& facts);

} // namespace gsc
