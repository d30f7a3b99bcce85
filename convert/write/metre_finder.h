// SPDX-License-Identifier: Apache-2.0
// Finds the metre of a model from the anchors while they are written. It is, bit for bit, the one that `gsc sample
// paths` derives from the file.
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
    // `params` must outlive this. `anchors`: number of all anchors.
    MetreFinder(const ModelParams& params, const Partition& partition, uint64_t anchors);
    MetreFinder(const MetreFinder&) = delete;
    MetreFinder& operator=(const MetreFinder&) = delete;

    // Takes a sample of the anchors of chunk number `index`, as addSurveyPoints() does. May be called in any order and
    // from several threads.
    void addChunk(size_t index, const ChunkRecord& chunk, std::span<const std::byte> payload);

    // Returns the metre, with units 0 if none can be derived. Call after the last chunk. Throws Error(Interrupted).
    Metre derive(const Checkpoint& checkpoint);

private:
    FileHeader m_header{};
    std::vector<LevelRecord> m_levels;
    GscView m_view;                           // holds the sections that a survey needs, before the file is written
    std::vector<std::vector<dvec3>> m_points; // the sampled positions of each chunk
};

} // namespace gsc
