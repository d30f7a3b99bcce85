// SPDX-License-Identifier: Apache-2.0
// A .gsc file as the baker takes a checkpoint, and a reduced model as the anchors of one.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/reduce/reduced_model.h"
#include "format/gsc_reader.h"

#include <string>
#include <vector>

namespace gsc {

// Everything but the anchors. `path` names it in messages. Precondition: openGsc() opened `view` without errors.
[[nodiscard]] Checkpoint checkpointOf(const GscView& view, const std::string& path);
// BakeOptions::appearance that keeps the rows which the file has.
[[nodiscard]] int appearanceOf(const GscView& view);

// Weights as the nearest halves.
void roundToHalves(std::vector<Mlp>& mlps);

// All anchors of a file in the order that takes fewest bits: by level, then along the Morton curve of their grid; floats
// stay as they lie. Or in the order of their source numbers.
[[nodiscard]] std::vector<uint32_t> anchorOrder(const GscView& view, bool by_source);

// The anchors of `order` that `model` keeps, with its values. Positions, rotations and what else there is are the file's.
// All must outlive it.
class ReducedAnchors final : public AnchorSource {
public:
    ReducedAnchors(const GscView& view, const ReducedModel& model, const std::vector<uint32_t>& order);
    bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) override;
    void rewind() override { m_next = 0; }
    [[nodiscard]] uint64_t count() const { return m_kept.size(); }

private:
    struct Place {
        uint32_t anchor, chunk;
    };
    void put(const Place& place, uint32_t fields, size_t at, AnchorBatch& batch) const;

    const GscView& m_view;
    const ReducedModel& m_model;
    std::vector<Place> m_kept;
    size_t m_next = 0;
};

} // namespace gsc
