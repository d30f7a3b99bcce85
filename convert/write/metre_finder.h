// SPDX-License-Identifier: Apache-2.0
// Finds the metre of a model from the anchors that are written: the same value, bit for bit, that `gsc sample paths`
// derives from the file.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/survey/vec3.h"
#include "convert/write/partition.h"
#include <gsc/gsc_reader.h>
#include "runtime/cameras/length.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gsc {

class MetreFinder {
public:
    // `params` must outlive this.
    MetreFinder(const ModelParams& params, const Partition& partition, uint64_t anchors);
    MetreFinder(const MetreFinder&) = delete;
    MetreFinder& operator=(const MetreFinder&) = delete;

    // Takes the anchors of chunk `index` that a survey looks at. Chunks may come in any order, from several threads.
    void addChunk(size_t index, const ChunkRecord& chunk, std::span<const std::byte> payload);

    // After the last chunk; units 0 where no metre can be derived. Throws Error(Interrupted).
    Metre derive(const Checkpoint& checkpoint);

private:
    FileHeader m_header{};
    std::vector<LevelRecord> m_levels;
    GscView m_view;                           // sections that are known before the file is written
    std::vector<std::vector<dvec3>> m_points; // per chunk
};

} // namespace gsc
