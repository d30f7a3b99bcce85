// SPDX-License-Identifier: Apache-2.0
// Makes the sections of a .gsc that do not depend on where the anchors lie: embedding, cameras, model parameters,
// manifest.
#pragma once

#include "convert/write/write_gsc.h"
#include <gsc/gsc_layout.h>
#include "runtime/cameras/length.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Numbers of the embedding rows that the file keeps: all, or the one that `appearance` names (-1 = all). Throws
// Error(Usage) if there is no such row.
std::vector<uint32_t> keptEmbeddingRows(const Checkpoint& checkpoint, int appearance);
// Values of the embedding row `number`. Precondition: the checkpoint has that row.
const float* embeddingRow(const Checkpoint& checkpoint, uint32_t number);
std::vector<std::byte> embeddingSection(const Checkpoint& checkpoint, const std::vector<uint32_t>& rows);
std::vector<std::byte> cameraSection(const Checkpoint& checkpoint);

// Parameters that the checkpoint alone decides. The caller sets counts, bounds and grid.
ModelParams modelParams(const Checkpoint& checkpoint);

// The options that decide the bytes of the file, as compact JSON, for FileHeader::config_hash.
std::string effectiveOptions(const WriteOptions& options);

struct ManifestFacts {
    const Checkpoint* checkpoint;
    const WriteOptions* options;
    const ModelParams* params;
    uint64_t source_rows, dropped;
    uint64_t source_hash, config_hash;
    std::vector<uint32_t> embedding_rows;
    std::span<const AnchorSensitivity> sensitivity; // one per anchor; empty if the file has no section SENS
    Metre metre;                                    // its units are 0 if no metre could be derived
};
// The manifest as UTF-8 JSON. It has no times, absolute paths or other facts that do not come from the model or the
// options.
std::string manifestText(const ManifestFacts& facts);

} // namespace gsc
