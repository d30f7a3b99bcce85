// SPDX-License-Identifier: Apache-2.0
// Cuts .gsc files to a box and joins them. No value of an anchor that stays is changed.
#pragma once

#include "convert/write/write_gsc.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Box in world units: from <= position < to on each axis, so that boxes side by side share no anchor.
struct CropBox {
    std::array<double, 3> from{}, to{};
};

struct TileOptions {
    std::vector<std::string> inputs; // paths of .gsc files
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
    std::vector<Tile> tiles; // one per input, in the order of the inputs
    uint64_t anchors = 0, bytes = 0;
    // anchors of the model that all inputs were cut from; 0 = they were not cut from one
    uint64_t whole_anchors = 0;
    bool is_whole = false; // the output equals the uncut model, byte for byte
    // anchors are in the row order of the uncut model; false: input by input
    bool in_source_order = false;
    std::vector<std::string> warnings;
    double seconds = 0;
};

// Writes the anchors of all inputs to one file: in the order of the rows of the model that all were cut from, else
// input by input. A file that was not cut counts as the whole of its model. Throws Error: Usage for a box that holds no
// anchor; Difference, with the names of file and field, for files of different models or with a common anchor; as
// openGsc() and writeGsc(). Then no file is left. The bytes do not depend on the number of threads.
TileReport joinTiles(const TileOptions& options, const WriteProgress& progress);

} // namespace gsc
