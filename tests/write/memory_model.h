// SPDX-License-Identifier: Apache-2.0
// Small models in memory, as the writer sees them.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/write/write_gsc.h"
#include <gsc/file/mapped_file.h>
#include <gsc/gsc_reader.h>
#include "tests/support/temporary_folder.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace gsc::test {

struct ModelShape {
    uint64_t anchors = 1000;
    uint32_t levels = 0; // 0 = Scaffold-GS
    uint32_t feat_dim = 8, n_offsets = 3;
    uint32_t appearance_dim = 0, appearance_rows = 0;
    bool feature_bank = false, distance = false, level_input = false;
    int32_t spread = 400; // quanta on either side of the middle, per axis
    float voxel_size = 0.01f, origin = 0;
    uint32_t seed = 1;
};

struct MemoryModel {
    Checkpoint checkpoint;
    AnchorBatch anchors; // all of them

    void removeAnchor(size_t i); // updates checkpoint.anchor_count
};

MemoryModel makeModel(const ModelShape& shape);

// Hands out the anchors in small batches; throws Error(Io) at row `fail_at`, raises SIGINT at row `interrupt_at`.
class MemorySource final : public AnchorSource {
public:
    explicit MemorySource(const MemoryModel& model) : m_model(model) {}
    bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) override;
    void rewind() override { m_next = 0; }

    uint64_t fail_at = UINT64_MAX, interrupt_at = UINT64_MAX;
    int passes_before_failure = 0; // complete passes before fail_at and interrupt_at count
    uint64_t rows = UINT64_MAX;    // fewer than the model has = a truncated source

private:
    const MemoryModel& m_model;
    uint64_t m_next = 0;
};

// A file that was written, opened; REQUIREs that it is valid in every respect, NanoVDB grids included.
struct Written {
    std::unique_ptr<MappedFile> file;
    GscView view;
    WriteReport report;
    std::string bytes() const;
};
Written writeModel(const MemoryModel& model, WriteOptions options = {});
Written openWritten(const std::string& path);

// Position of an anchor as the file reproduces it.
void storedPosition(const GscView& view, const ChunkRecord& chunk, uint32_t local, float out[3]);
const std::byte* storedValue(const GscView& view, const ChunkRecord& chunk, ChunkArray array, uint32_t local);

} // namespace gsc::test
