// SPDX-License-Identifier: Apache-2.0
// Cuts files to a box and joins them. Exact: draws nothing, and changes no value of an anchor that stays.
#pragma once

#include "convert/write/write_gsc.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Box in world units, from <= position < to on each axis: boxes side by side share no anchor.
struct CropBox {
    std::array<double, 3> from{}, to{};
};

struct TileOptions {
    std::vector<std::string> inputs; // .gsc files
    std::vector<std::string> names;  // names of the inputs in messages
    std::string output;
    bool overwrite = false;
    std::optional<CropBox> crop;
    int threads = 0;
};

struct TileReport {
    struct Tile {
        uint64_t anchors, kept;
    };
    std::vector<Tile> tiles; // one per input, in their order
    uint64_t anchors = 0, bytes = 0;
    uint64_t whole_anchors = 0;   // anchors of the model that all are parts of, 0 = there is none
    bool is_whole = false;        // the output is that model again, byte for byte
    bool in_source_order = false; // rows follow each other as in that model; else tile by tile
    std::vector<std::string> warnings;
    double seconds = 0;
};

// Joins files that were cut from one model in the order of its rows, others one after another. A file that was not cut
// counts as the whole of its model. Throws Error: Usage for a box that holds no anchor; Difference, naming file and
// field, for files that are not of one model or share an anchor; as openGsc() and writeGsc(). Then no file is left.
// Bytes do not depend on the number of threads.
TileReport joinTiles(const TileOptions& options, const WriteProgress& progress);

} // namespace gsc
