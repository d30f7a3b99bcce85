// SPDX-License-Identifier: Apache-2.0
// The metre of a model, from the anchors as they are written: what `gsc sample paths` derives from the file, bit for bit.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/write/partition.h"
#include "player/cameras/length.h"

#include <cstddef>
#include <memory>
#include <span>

namespace gsc {

class MetreFinder {
public:
    // `params` must outlive this.
    MetreFinder(const ModelParams& params, const Partition& partition, uint64_t anchors);
    ~MetreFinder();
    MetreFinder(const MetreFinder&) = delete;
    MetreFinder& operator=(const MetreFinder&) = delete;

    // Takes the anchors of chunk `index` that a survey looks at. Chunks may come in any order, from several threads.
    void addChunk(size_t index, const ChunkRecord& chunk, std::span<const std::byte> payload);

    // After the last chunk; units 0 where no metre can be derived. Throws Error(Interrupted).
    Metre derive(const Checkpoint& checkpoint);

private:
    struct State; // note: the survey's vectors have the name of the kernels'
    std::unique_ptr<State> m_state;
};

} // namespace gsc
