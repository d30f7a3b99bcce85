// SPDX-License-Identifier: Apache-2.0
// Checkpoint -> .gsc: spatial index, order, chunks, packed weights, manifest. Streaming: the source is read three
// times in order, memory grows with the number of cells and not with the bytes of the file.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

enum class SensitivityMode { None, Sampled }; // section SENS: left out, or the largest of six directions

// Source of a file made from other files: their checkpoint, and the changes.
struct KnownSource {
    uint64_t hash = 0; // FileHeader::source_hash
    // JSON object: what the manifest says of "source", and keys that it has besides: "reduction" or "reductions" where
    // values are not the checkpoint's, "crop"
    std::string facts;
    std::vector<std::byte> tile; // section TILE, empty = none
};

struct WriteOptions {
    std::string output;
    bool overwrite = false;
    int threads = 0;                // 0 = all cores; the bytes written do not depend on it
    int appearance = -1;            // row of the embedding to keep, -1 = all
    uint64_t chunk_anchors = 16384; // the smallest cell whose chunks hold this many anchors on average is taken
    bool drop_invalid = false;      // leave out anchors upstream never shows (NaN) or that would paint the image (inf)
    SensitivityMode sensitivity = SensitivityMode::Sampled;
    uint64_t memory_budget = 0; // bytes for buffers, 0 = 1 GiB, or a quarter of memory if less
    std::optional<KnownSource> source;
    // Called with the path of the finished file before it gets its name; an exception leaves the output as it was.
    std::function<void(const std::string& path)> verify;
};

struct WriteStage {
    std::string name;
    double seconds;
};

struct WriteReport {
    uint64_t anchors = 0, dropped = 0, input_bytes = 0, output_bytes = 0;
    uint64_t levels = 0, chunks = 0, groups = 0, leaves = 0;
    bool exact_grid = false;        // positions stored as integers, every one bit-exact
    Metre metre;                    // stated in the manifest; units 0 = none could be derived
    double sensitivity_seconds = 0; // CPU time of all threads together, part of the stage "chunks"
    std::vector<WriteStage> stages;
    std::vector<std::string> warnings;
};

// Called from one thread, often; `done` of `total` in units of the stage.
using WriteProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Throws Error (Io, InvalidFile, OutOfMemory, Interrupted); then no output file and no temporary file is left.
WriteReport writeGsc(const Checkpoint& checkpoint, const WriteOptions& options, const WriteProgress& progress);
// Writes as writeGsc(), but the anchors of `source` instead of those of the checkpoint's PLY. If ply_path and
// weight_paths are empty the source hash is that of nothing.
WriteReport writeGscFrom(const Checkpoint& checkpoint, AnchorSource& source, const WriteOptions& options,
                         const WriteProgress& progress);

} // namespace gsc
