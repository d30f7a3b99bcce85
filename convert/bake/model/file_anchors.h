// SPDX-License-Identifier: Apache-2.0
// Reads anchors of .gsc files through AnchorSource, the interface by which the writer reads a checkpoint.
#pragma once

#include "convert/bake/model/reduced_model.h"
#include "convert/input/checkpoint.h"
#include <gsc/gsc_reader.h>

#include <cstdint>
#include <vector>

namespace gsc {

struct AnchorPlace {
    uint32_t file, chunk, anchor; // number of the input file, of the chunk in it, of the anchor in the file
};

// Places of the anchors of `order` that `model` does not leave out. `view`: the only file.
[[nodiscard]] std::vector<AnchorPlace> keptPlaces(const GscView& view, const ReducedModel& model,
                                                  const std::vector<uint32_t>& order);

// Reads the anchors at `places`, in that order, with the values of their files bit for bit. If `model`, made of the
// only file, is given, scales, offsets and features are taken from it. All arguments must outlive this.
class FileAnchors final : public AnchorSource {
public:
    FileAnchors(const std::vector<GscView>& files, const std::vector<AnchorPlace>& places,
                const ReducedModel* model = nullptr)
        : m_files(files), m_places(places), m_model(model)
    {
    }
    bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) override;
    void rewind() override { m_next = 0; }

private:
    void put(const AnchorPlace& place, uint32_t fields, size_t at, AnchorBatch& batch) const;

    const std::vector<GscView>& m_files;
    const std::vector<AnchorPlace>& m_places;
    const ReducedModel* m_model;
    size_t m_next = 0;
};

} // namespace gsc
