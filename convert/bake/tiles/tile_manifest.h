// SPDX-License-Identifier: Apache-2.0
// Manifest facts of a file that was cut from another or joined from several.
#pragma once

#include "convert/bake/tiles/tiles.h"
#include <gsc/gsc_layout.h>

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct TileFacts {
    std::vector<std::string_view> manifests; // of the files it is made of
    bool one_model = false;                  // all were cut from one
    uint64_t source_hash = 0;
    std::optional<TileRecord> tile; // of what it is a part
    std::optional<CropBox> box;
};

// KnownSource::facts. A model that was cut and joined again, whole, gets the facts it had before.
[[nodiscard]] std::string tileFactsText(const TileFacts& facts);

} // namespace gsc
