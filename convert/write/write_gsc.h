// SPDX-License-Identifier: Apache-2.0
// Writes a checkpoint as a .gsc file: spatial index, order of the anchors, chunks, packed weights, manifest. The source
// is read three times from start to end; memory grows with the number of cells and not with the size of the file.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

enum class SensitivityMode { None, Sampled }; // section SENS: none, or the largest sensitivity over six directions

// Says, for a file that is made from other files, which checkpoint they came from and what was changed.
struct KnownSource {
    uint64_t hash = 0; // value of FileHeader::source_hash
    // JSON object for the manifest: its "source", and the keys that the file has besides: "reduction" or "reductions"
    // if values differ from the checkpoint's, "crop" if it was cut.
    std::string facts;
    std::vector<std::byte> tile; // section TILE; empty = none
};

struct WriteOptions {
    std::string output;
    bool overwrite = false;
    int threads = 0;                // 0 = all cores; the bytes written do not depend on it
    int appearance = -1;            // row of the appearance embedding to keep; -1 = all
    uint64_t chunk_anchors = 16384; // least anchors in a chunk on average; the cells are the smallest that reach it
    // leave out anchors that the trainer never shows (NaN) or that would cover the picture (inf)
    bool drop_invalid = false;
    SensitivityMode sensitivity = SensitivityMode::Sampled;
    uint64_t memory_budget = 0; // bytes for buffers; 0 = 1 GiB, or a quarter of main memory if that is less
    std::optional<KnownSource> source;
    // Called with the path of the finished file before it is renamed to `output`; an exception leaves `output` as it
    // was.
    std::function<void(const std::string& path)> verify;
};

struct WriteStage {
    std::string name;
    double seconds;
};

struct WriteReport {
    uint64_t anchors = 0, dropped = 0, input_bytes = 0, output_bytes = 0;
    uint64_t levels = 0, chunks = 0, groups = 0, leaves = 0;
    bool exact_grid = false; // all positions are stored as integers, from which they come back bit for bit
    Metre metre;             // metre in the manifest; its units are 0 if none could be derived
    // CPU seconds of all threads together, a part of the stage "chunks"
    double sensitivity_seconds = 0;
    std::vector<WriteStage> stages;
    std::vector<std::string> warnings;
};

// Reports progress, often, always from the thread that called writeGsc(): `done` of `total`, in units that depend on
// the stage.
using WriteProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Writes a .gsc file. Throws Error (Io, InvalidFile, OutOfMemory, Interrupted); then no output and no temporary file is
// left.
WriteReport writeGsc(const Checkpoint& checkpoint, const WriteOptions& options, const WriteProgress& progress);
// Writes as writeGsc(), but the anchors of `source` instead of those in the checkpoint's PLY. If ply_path and
// weight_paths are empty, the source hash is that of no bytes.
WriteReport writeGscFrom(const Checkpoint& checkpoint, AnchorSource& source, const WriteOptions& options,
                         const WriteProgress& progress);

} // namespace gsc
