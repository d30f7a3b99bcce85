// SPDX-License-Identifier: Apache-2.0
// A model in memory with some slots and anchors left out and other values rounded, in the form that a renderer reads.
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

// Kinds of change by which a bake makes a file smaller.
enum Lever : uint32_t {
    kLeverSlots = 1u << 0,    // masks the slots that matter least to pictures
    kLeverAnchors = 1u << 1,  // leaves out the anchors that matter least to pictures
    kLeverFeatures = 1u << 2, // rounds features to multiples of a power of two, chosen per anchor
    kLeverOffsets = 1u << 3,  // rounds offsets to multiples of a power of two
    kLeverScales = 1u << 4,   // rounds scales to multiples of a power of two
    kLeverNetworks = 1u << 5, // rounds networks to half precision
    kLeverOrder = 1u << 6,    // orders anchors by place: the order of the checkpoint's rows is lost
    kLeverCompact = 1u << 7,  // rounds so coarsely that values take half of the bytes on a GPU (kModelCompact)
};
// kAllLevers: those that change only the size of the archive
constexpr uint32_t kLevers = 8, kAllLevers = kLeverCompact - 1;
extern const char* const kLeverNames[kLevers];

// Factors that turn a change of a value into error of the pictures: a change by x costs `x^2 * importance * factor` in
// summed squared error. There is one for a feature, a position and the logarithm of a size, and one for leaving out a
// slot or an anchor.
struct ErrorCosts {
    double feature = 0.02, place = 0.05, size = 0.05, slot = 0.2, anchor = 0.25;

    bool operator==(const ErrorCosts&) const = default;
};

struct BakePlan {
    uint32_t levers = kAllLevers;
    // Summed squared error that rounding one value may cost; 0 = only leave out Gaussians that are never drawn.
    double error = 0;
    ErrorCosts costs;

    bool operator==(const BakePlan&) const = default;
};

class ReducedModel {
public:
    // All arguments must outlive this; `importance` only until the last apply(). `weights`, `packed`: sections MLPW and
    // MLPP in half precision. Takes 4 bytes for each number of the scales, offsets and features. `read`: called when a
    // chunk of the source was read; may be empty.
    ReducedModel(const ModelView& source, const Importance& importance, const Workers& workers,
                 std::span<const std::byte> weights, std::span<const std::byte> packed, ChunkRead read = {});

    // Changes the model as `plan` says, from the values of the source. The result does not depend on the number of
    // threads.
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
    [[nodiscard]] uint64_t masked() const { return m_slots_out; } // masked slots of the anchors that stay

    // Sets the source index that each anchor will have in the file. Gaussians of equal depth are drawn in that order.
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
    std::unique_ptr<float[]> m_scale, m_offset, m_feature; // values of all anchors, written by apply()
    std::vector<uint32_t> m_number;
    std::vector<uint8_t> m_left_out;
    std::vector<uint16_t> m_masks; // per anchor: number of its slots that are masked
    std::optional<BakePlan> m_applied;
    uint64_t m_anchors_out = 0, m_slots_out = 0;
    std::span<const std::byte> m_weights, m_packed;
    double m_median_weight = 0, m_median_place = 0; // medians of importance over the slots that are drawn
    double m_unseen_weight = 0, m_unseen_place = 0; // importance of a slot whose anchor no pose saw
    ModelView m_view;
};

} // namespace gsc
