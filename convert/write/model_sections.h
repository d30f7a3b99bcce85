// SPDX-License-Identifier: Apache-2.0
// The sections of a .gsc that do not depend on the anchors' places: embedding, cameras, model parameters, manifest.
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

// Rows of the embedding that are kept: all, or one. Throws Error(Usage) if `appearance` is not a row.
std::vector<uint32_t> keptEmbeddingRows(const Checkpoint& checkpoint, int appearance);
// Precondition: it has the row.
const float* embeddingRow(const Checkpoint& checkpoint, uint32_t number);
std::vector<std::byte> embeddingSection(const Checkpoint& checkpoint, const std::vector<uint32_t>& rows);
std::vector<std::byte> cameraSection(const Checkpoint& checkpoint);

// Everything the checkpoint alone decides; counts, bounds and grid are the caller's.
ModelParams modelParams(const Checkpoint& checkpoint);

// The options that decide the bytes of the file, as compact JSON: input of FileHeader::config_hash.
std::string effectiveOptions(const WriteOptions& options);

struct ManifestFacts {
    const Checkpoint* checkpoint;
    const WriteOptions* options;
    const ModelParams* params;
    uint64_t source_rows, dropped;
    uint64_t source_hash, config_hash;
    std::vector<uint32_t> embedding_rows;
    std::span<const AnchorSensitivity> sensitivity; // empty if there are none
    Metre metre;                                    // units 0 = none could be derived
};
// UTF-8 JSON without times, absolute paths or anything else that is not of the model and the options.
std::string manifestText(const ManifestFacts& facts);

} // namespace gsc
