// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/model/reduced_model.h"

#include "format/numbers/compact.h"
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <optional>

namespace gsc {

const char* const kLeverNames[kLevers] = {"slots",  "anchors",  "features", "offsets",
                                          "scales", "networks", "order",    "compact"};

namespace {

// Exponents of the finest and the coarsest step: a finer step would store noise, a coarser one would save nothing.
constexpr int kFinestStep = -20, kCoarsestStep = 8;
// Bits that leaving out a slot or an anchor saves, beside the values of its slots. A saved bit may cost as much error
// as it does where a value is rounded: 2 ln 2 / 12 of BakePlan::error.
constexpr double kSlotBits = 22, kAnchorBits = 260, kErrorPerBit = 0.1155;
// The poses of a bake do not show all that a visitor may see. So each slot gets importance on top of the measured one,
// in shares of the median slot: kDead if no pose of the bake could make it opaque; kAsleep or kSeldom times the share
// of poses that could, less if many poses saw its anchor; kAlways in any case. An anchor that no pose saw counts as
// much as the seen one at quantile kUnseenRank. The numbers come from trained models, tested with poses that the bake
// did not have.
constexpr double kDead = 1e-4, kAsleep = 2, kSeldom = 2, kAlways = 0.01, kUnseenRank = 0.6;

float maskedOffset()
{
    return std::bit_cast<float>(kMaskedOffset);
}

// Exponent of the step with which rounding a value of this importance costs about `error`.
int stepOf(double error, double importance)
{
    if (!(importance > 0))
        return kCoarsestStep;
    const double step = std::sqrt(error / importance);
    return std::clamp(int(std::lround(std::log2(step))), kFinestStep, kCoarsestStep);
}

void round(const float* from, uint32_t count, int exponent, float* to)
{
    const double step = std::ldexp(1.0, exponent), inverse = std::ldexp(1.0, -exponent);
    for (uint32_t i = 0; i < count; ++i)
        // note: adding 0.0 turns -0.0 into 0.0; a value of 2^23 steps or more has no bits below the step
        to[i] = std::isfinite(from[i]) && std::fabs(from[i]) * inverse < 0x1p23
                    ? float(std::nearbyint(double(from[i]) * inverse) * step + 0.0)
                    : from[i];
}

float largestOf(std::span<const float> values)
{
    float largest = 0;
    for (const float v : values)
        if (std::isfinite(v))
            largest = std::max(largest, std::fabs(v));
    return largest;
}

// Finds quantiles of the values above zero in two passes without a copy: positive floats are ordered like their bits as
// integers.
class Ranks {
public:
    explicit Ranks(std::span<const float> values) : m_values(values), m_high(kBuckets)
    {
        for (const float v : values)
            if (v > 0) {
                ++m_high[std::bit_cast<uint32_t>(v) >> 16];
                ++m_count;
            }
    }

    // Value at quantile `share`, 0 to 1, of the values above zero; 0 if there are none.
    [[nodiscard]] double at(double share) const
    {
        if (m_count == 0)
            return 0;
        auto rank = uint64_t(double(m_count - 1) * share);
        const uint32_t high = bucketOf(rank, m_high);
        std::vector<uint64_t> low(kBuckets);
        for (const float v : m_values)
            if (v > 0 && std::bit_cast<uint32_t>(v) >> 16 == high)
                ++low[std::bit_cast<uint32_t>(v) & 0xffff];
        return double(std::bit_cast<float>(high << 16 | bucketOf(rank, low)));
    }

private:
    static constexpr size_t kBuckets = size_t(1) << 16;

    // Bucket that holds the value of this rank; `rank` becomes the rank among the values in the bucket.
    static uint32_t bucketOf(uint64_t& rank, const std::vector<uint64_t>& counts)
    {
        uint32_t bucket = 0;
        for (; rank >= counts[bucket]; ++bucket)
            rank -= counts[bucket];
        return bucket;
    }

    std::span<const float> m_values;
    std::vector<uint64_t> m_high;
    uint64_t m_count = 0;
};

} // namespace

ReducedModel::ReducedModel(const ModelView& source, const Importance& importance, const Workers& workers,
                           std::span<const std::byte> weights, std::span<const std::byte> packed, ChunkRead read)
    : m_source(source), m_importance(importance), m_workers(workers), m_read(std::move(read)), m_params(*source.params),
      m_chunks(source.chunks, source.chunks + source.params->chunk_count),
      m_groups(source.groups, source.groups + source.params->group_count),
      m_arrays(source.arrays, source.arrays + source.params->chunk_count), m_weights(weights), m_packed(packed),
      m_view(source)
{
    const uint64_t anchors = importance.seen.size();
    m_scale = std::make_unique_for_overwrite<float[]>(6 * anchors);
    m_offset = std::make_unique_for_overwrite<float[]>(size_t(3) * m_params.n_offsets * anchors);
    m_feature = std::make_unique_for_overwrite<float[]>(size_t(m_params.feat_dim) * anchors);
    m_left_out.resize(anchors);
    m_masks.resize(anchors);
    m_params.flags |= kModelMaskedSlots;
    for (size_t c = 0; c < m_chunks.size(); ++c) {
        const size_t first = m_chunks[c].anchor_first;
        m_arrays[c].scale = m_scale.get() + 6 * first;
        m_arrays[c].offset = m_offset.get() + 3 * m_params.n_offsets * first;
        m_arrays[c].feature = m_feature.get() + m_params.feat_dim * first;
    }
    m_view.params = &m_params;
    m_view.chunks = m_chunks.data();
    m_view.groups = m_groups.data();
    m_view.arrays = m_arrays.data();
    m_view.sensitivity = nullptr;
    const Ranks of_weights(importance.weight), of_places(importance.place);
    m_median_weight = of_weights.at(0.5);
    m_median_place = of_places.at(0.5);
    m_unseen_weight = of_weights.at(kUnseenRank);
    m_unseen_place = of_places.at(kUnseenRank);
}

// Importance of a slot: the measured one, plus an amount for views that the poses of the bake do not show.
double ReducedModel::worth(uint64_t anchor, uint32_t k, double measured, double median, double unseen) const
{
    const uint32_t seen = m_importance.seen[anchor];
    const size_t slot = anchor * m_params.n_offsets + k;
    const double alive = double(m_importance.alive[slot]) / std::max(m_importance.places, 1u);
    if (alive == 0 && measured == 0)
        return kDead * median;
    if (seen == 0)
        return unseen;
    return measured + median * (measured == 0 ? kAsleep * alive : kSeldom * alive / (seen + 1) + kAlways);
}

void ReducedModel::applyTo(uint64_t anchor, uint32_t chunk, uint32_t local, const BakePlan& plan)
{
    const uint32_t K = m_params.n_offsets, F = m_params.feat_dim;
    const ChunkArrays& from = m_source.arrays[chunk];
    const float *const scale = from.scale + size_t(6) * local, *const offset = from.offset + size_t(3) * K * local;
    float* const to_offset = m_offset.get() + size_t(3) * K * anchor;
    double extent[3];
    for (int i = 0; i < 3; ++i)
        extent[i] = std::exp(double(scale[i]));

    // sums over the slots that are not masked
    double weight = 0, place = 0, moves[3] = {};
    uint32_t kept = 0;
    bool masked[kMaxOffsets] = {};
    for (uint32_t k = 0; k < K; ++k) {
        const float* const o = offset + 3 * k;
        const size_t slot = anchor * K + k;
        const bool never = plan.error == 0 && m_importance.weight[slot] == 0 && m_importance.alive[slot] == 0;
        const double w = worth(anchor, k, double(m_importance.weight[slot]), m_median_weight, m_unseen_weight);
        masked[k] =
            o[0] != o[0] || // masked already in the source
            ((plan.levers & kLeverSlots) && (never || w * plan.costs.slot <= kErrorPerBit * kSlotBits * plan.error));
        if (masked[k])
            continue;
        ++kept;
        weight += w;
        const double p = worth(anchor, k, double(m_importance.place[slot]), m_median_place, m_unseen_place);
        for (int i = 0; i < 3; ++i) {
            place += p * extent[i] * extent[i] / 3;
            moves[i] += p * double(o[i]) * double(o[i]) * extent[i] * extent[i];
        }
    }
    const bool left_out =
        (plan.levers & kLeverAnchors) &&
        (kept == 0 || weight * plan.costs.anchor <= kErrorPerBit * (kAnchorBits + kSlotBits * kept) * plan.error);
    m_left_out[anchor] = left_out;
    m_masks[anchor] = uint16_t(K - kept);
    if (left_out) { // all slots masked, so that the renderer draws nothing of the anchor
        std::fill_n(to_offset, 3 * K, maskedOffset());
        std::copy_n(scale, 6, m_scale.get() + 6 * anchor);
        std::copy_n(from.feature + size_t(F) * local, F, m_feature.get() + size_t(F) * anchor);
        return;
    }
    // rounds `count` values as the plan says. `least`: exponent of the finest step that fits the compact form; none for
    // a plan without it
    const auto put = [&](uint32_t lever, const float* values, uint32_t count, double importance, float* to,
                         std::optional<int> least = {}) {
        const bool by_plan = (plan.levers & lever) && plan.error > 0;
        if (by_plan)
            round(values, count, std::max(stepOf(plan.error, importance), least.value_or(kFinestStep)), to);
        else if (least)
            round(values, count, *least, to);
        else
            std::copy_n(values, count, to);
    };
    const auto leastOf = [&](std::span<const float> values, int bits) {
        return plan.levers & kLeverCompact ? std::optional(compactExponent(largestOf(values), bits)) : std::nullopt;
    };
    const double n = std::max(kept, 1u);
    const std::span<const float> feature(from.feature + size_t(F) * local, F);
    put(kLeverFeatures, feature.data(), F, weight * plan.costs.feature, m_feature.get() + size_t(F) * anchor,
        leastOf(feature, kCompactFeatureBits));
    for (uint32_t k = 0; k < K; ++k)
        if (masked[k])
            std::fill_n(to_offset + 3 * k, 3, maskedOffset());
        else
            std::copy_n(offset + 3 * k, 3, to_offset + 3 * k);
    // finest step for the offsets of all slots that are not masked
    const std::optional<int> least = leastOf({to_offset, size_t(3) * K}, kCompactOffsetBits);
    for (uint32_t k = 0; k < K; ++k)
        if (!masked[k])
            put(kLeverOffsets, offset + 3 * k, 3, place / n * plan.costs.place, to_offset + 3 * k, least);
    put(kLeverScales, scale, 3, (moves[0] + moves[1] + moves[2]) / 3 * plan.costs.place, m_scale.get() + 6 * anchor);
    put(kLeverScales, scale + 3, 3, weight * plan.costs.size, m_scale.get() + 6 * anchor + 3);
}

// Sets the largest scales of each group and of the chunk anew: selection relies on no scale of an anchor being larger.
void ReducedModel::boundChunk(uint32_t c)
{
    ChunkRecord& chunk = m_chunks[c];
    chunk.anchor_sigma_max = chunk.gaussian_sigma_max = 0;
    for (uint32_t g = chunk.group_first; g < chunk.group_first + chunk.group_count; ++g) {
        GroupRecord& group = m_groups[g];
        float anchor = -INFINITY, gaussian = -INFINITY;
        for (uint32_t i = 0; i < group.anchor_count; ++i)
            for (int a = 0; a < 3; ++a) {
                anchor = std::max(anchor, m_scale[6 * size_t(group.anchor_first + i) + a]);
                gaussian = std::max(gaussian, m_scale[6 * size_t(group.anchor_first + i) + 3 + a]);
            }
        group.anchor_sigma_max = float(std::exp(double(anchor)) * (1 + 0x1p-18));
        group.gaussian_sigma_max = float(std::exp(double(gaussian)) * (1 + 0x1p-18));
        chunk.anchor_sigma_max = std::max(chunk.anchor_sigma_max, group.anchor_sigma_max);
        chunk.gaussian_sigma_max = std::max(chunk.gaussian_sigma_max, group.gaussian_sigma_max);
    }
}

void ReducedModel::apply(const BakePlan& plan)
{
    if (m_applied == plan)
        return;
    m_applied.reset();
    m_workers.run(m_chunks.size(), 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            for (uint32_t i = 0; i < m_chunks[c].anchor_count; ++i)
                applyTo(uint64_t(m_chunks[c].anchor_first) + i, uint32_t(c), i, plan);
            boundChunk(uint32_t(c));
            if (m_read)
                m_read(uint32_t(c));
        }
    });
    const bool halves = (plan.levers & kLeverNetworks) != 0;
    m_view.weights = halves ? m_weights.data() : m_source.weights;
    m_view.packed = halves ? m_packed.data() : m_source.packed;
    m_anchors_out = m_slots_out = 0;
    for (size_t a = 0; a < m_left_out.size(); ++a) {
        m_anchors_out += m_left_out[a];
        m_slots_out += m_left_out[a] ? 0 : m_masks[a];
    }
    m_applied = plan;
}

void ReducedModel::setOrder(std::vector<uint32_t> number)
{
    m_number = std::move(number);
    for (size_t c = 0; c < m_chunks.size(); ++c)
        m_arrays[c].source_index = m_number.data() + m_chunks[c].anchor_first;
}

} // namespace gsc
