// SPDX-License-Identifier: Apache-2.0
// A model in memory, as a renderer reads it, with slots and anchors left out and the other values rounded to coarser steps.
#pragma once

#include "convert/bake/weights/importance.h"
#include <gsc/frame_types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

class Workers;

// Changes that a bake may make so that a file gets smaller.
enum Lever : uint32_t {
    kLeverSlots = 1u << 0,    // slots that add least are masked
    kLeverAnchors = 1u << 1,  // anchors that add least are left out
    kLeverFeatures = 1u << 2, // features rounded to steps of a power of two, chosen per anchor
    kLeverOffsets = 1u << 3,  // offsets, likewise
    kLeverScales = 1u << 4,   // scales, likewise
    kLeverNetworks = 1u << 5, // networks rounded to halves
    kLeverOrder = 1u << 6,    // anchors reordered: the order of the checkpoint's rows is lost
    kLeverCompact = 1u << 7,  // steps so coarse that a GPU holds them in half of the bytes (kModelCompact)
};
constexpr uint32_t kLevers = 8, kAllLevers = kLeverCompact - 1; // all levers that only make the archive smaller
extern const char* const kLeverNames[kLevers];

// Factors of the cost of an error: a change of a value by x costs `x^2 * importance * factor` in summed squared error.
// Factors for a feature, a position, the logarithm of a size, and for leaving out a slot or an anchor.
struct ErrorCosts {
    double feature = 0.02, place = 0.05, size = 0.05, slot = 0.2, anchor = 0.25;

    bool operator==(const ErrorCosts&) const = default;
};

struct BakePlan {
    uint32_t levers = kAllLevers;
    // summed squared error that rounding one value may cost; 0 = only Gaussians that are never drawn go
    double error = 0;
    ErrorCosts costs;

    bool operator==(const BakePlan&) const = default;
};

class ReducedModel {
public:
    // All arguments must outlive this, `importance` only until the last apply(). `weights`, `packed`: sections MLPW and MLPP in
    // halves. Takes 4 bytes for each value of a scale, an offset and a feature. `read` is called for chunks of the source;
    // may be empty.
    ReducedModel(const ModelView& source, const Importance& importance, const Workers& workers,
                 std::span<const std::byte> weights, std::span<const std::byte> packed, ChunkRead read = {});

    // Applies the plan to the source, unless it is applied already. The result does not depend on the number of threads.
    void apply(const BakePlan& plan);

    [[nodiscard]] const ModelView& view() const { return m_view; }
    [[nodiscard]] const ModelView& source() const { return m_source; }
    [[nodiscard]] bool isLeftOut(uint64_t anchor) const { return m_left_out[anchor] != 0; }
    [[nodiscard]] const float* scale(uint64_t anchor) const { return m_scale.get() + 6 * anchor; }
    [[nodiscard]] const float* offset(uint64_t anchor) const
    {
        return m_offset.get() + 3 * m_params.n_offsets * anchor;
    }
    [[nodiscard]] const float* feature(uint64_t anchor) const { return m_feature.get() + m_params.feat_dim * anchor; }
    [[nodiscard]] uint64_t anchors() const { return m_left_out.size(); }
    [[nodiscard]] uint64_t leftOut() const { return m_anchors_out; }
    [[nodiscard]] uint64_t masked() const { return m_slots_out; } // slots of the anchors that stay

    // Sets the source indices that anchors will have in the file: they order splats of equal depth.
    void setOrder(std::vector<uint32_t> number);

private:
    void applyTo(uint64_t anchor, uint32_t chunk, uint32_t local, const BakePlan& plan);
    void boundChunk(uint32_t chunk);
    [[nodiscard]] double worth(uint64_t anchor, uint32_t k, double measured, double median, double unseen) const;

    const ModelView& m_source;
    const Importance& m_importance;
    const Workers& m_workers;
    const ChunkRead m_read;
    ModelParams m_params;
    std::vector<ChunkRecord> m_chunks;
    std::vector<GroupRecord> m_groups;
    std::vector<ChunkArrays> m_arrays;
    std::unique_ptr<float[]> m_scale, m_offset, m_feature; // written by apply()
    std::vector<uint32_t> m_number;
    std::vector<uint8_t> m_left_out;
    std::vector<uint16_t> m_masks; // per anchor: slots that this masks, beyond those masked before
    std::optional<BakePlan> m_applied;
    uint64_t m_anchors_out = 0, m_slots_out = 0;
    std::span<const std::byte> m_weights, m_packed;
    double m_median_weight = 0, m_median_place = 0; // medians over the slots that draw
    double m_unseen_weight = 0, m_unseen_place = 0; // per slot, for anchors that no pose saw
    ModelView m_view;
};

} // namespace gsc
