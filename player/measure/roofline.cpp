// SPDX-License-Identifier: Apache-2.0
#include "player/measure/roofline.h"

#include "kernels/math/mlp.h"

#include <algorithm>

namespace gsc {

namespace {

// Bytes of the records that stages pass on. Another layout of them in a backend changes these.
constexpr double kPositionBytes = 16; // x, y, z, level
constexpr double kSizeBytes = 24, kTestedSizeBytes = 12;
constexpr double kVisibleBytes = 4;
constexpr double kPackedOffsetBytes = 8; // offset of a Gaussian in tier fast
constexpr double kSplatBytes = 32, kExactSplatBytes = 48;
constexpr double kSplatKeyBytes = 8; // depth and tile box, kept apart from the splat
constexpr double kPairBytes = 8;     // depth and splat index
constexpr double kIndexBytes = 4;
constexpr double kPixelBytes = 12;

// Operations of one (pixel, splat) evaluation: two for the offset, five for the exponent, two for alpha and its cap,
// five for weight, transmittance and colour; comparisons not counted.
constexpr double kLanesPerEvaluation = 14;

double largest(const EyeCounts* eyes, uint32_t eye_count, uint64_t EyeCounts::*field)
{
    uint64_t most = 0;
    for (uint32_t e = 0; e < eye_count; ++e)
        most = std::max(most, eyes[e].*field);
    return double(most);
}

double sum(const EyeCounts* eyes, uint32_t eye_count, uint64_t EyeCounts::*field)
{
    double total = 0;
    for (uint32_t e = 0; e < eye_count; ++e)
        total += double(eyes[e].*field);
    return total;
}

} // namespace

AnchorCost anchorCost(const ModelView& model, Tier tier)
{
    const ModelParams& params = *model.params;
    AnchorCost cost;
    cost.exact = tier == Tier::Exact;
    cost.bytes = kVisibleBytes + kPositionBytes + kSizeBytes +
                 (cost.exact ? 4.0 * params.feat_dim + 12.0 * params.n_offsets
                             : 2.0 * params.feat_dim + kPackedOffsetBytes * params.n_offsets);
    cost.splat_bytes = cost.exact ? kExactSplatBytes : kSplatBytes;
    const bool banked = mlpRecord(model, MlpKind::FeatureBank) != nullptr;
    const auto* records = reinterpret_cast<const MlpRecord*>(model.weights);
    for (uint32_t i = 0; i < params.mlp_count; ++i) {
        const MlpRecord& mlp = records[i];
        const double features = (mlp.inputs & kMlpTakesFeature) != 0 ? params.feat_dim : 0;
        const double folded = (mlp.inputs & kMlpTakesAppearance) != 0 ? params.appearance_dim : 0;
        (banked ? cost.eye_macs : cost.shared_macs) += features * mlp.hidden;
        cost.eye_macs += (mlp.in - features - folded) * mlp.hidden + double(mlp.hidden) * mlp.out;
    }
    return cost;
}

FrameWork leastWork(const AnchorCost& anchor, const EyeCounts* eyes, uint32_t eye_count, double pixels,
                    bool sorts_apart)
{
    const double visible = largest(eyes, eye_count, &EyeCounts::anchors_visible);
    const double splats = sum(eyes, eye_count, &EyeCounts::gaussians_visible);
    const double pairs = sum(eyes, eye_count, &EyeCounts::pairs);
    // with counts in the first eye alone both eyes read one list of tiles; otherwise each eye has tiles of its own
    const bool shared = eye_count == 2 && eyes[1].pairs == 0 && eyes[1].gaussians_visible != 0;
    const double listed = shared ? largest(eyes, eye_count, &EyeCounts::gaussians_visible) : splats;
    const double evaluations = sum(eyes, eye_count, &EyeCounts::blend_evaluations);
    FrameWork work;

    work.select.bytes_read = double(sizeof(GroupRecord)) * largest(eyes, eye_count, &EyeCounts::groups_tested) +
                             (kPositionBytes + kTestedSizeBytes) * largest(eyes, eye_count, &EyeCounts::anchors_tested);
    work.select.bytes_written = kVisibleBytes * visible;

    work.decode.bytes_read = anchor.bytes * visible;
    work.decode.bytes_written = anchor.splat_bytes * splats + kSplatKeyBytes * listed;
    const double macs =
        anchor.shared_macs * visible + anchor.eye_macs * sum(eyes, eye_count, &EyeCounts::anchors_visible);
    if (anchor.exact)
        work.decode.lane_operations = macs;
    else
        work.decode.matrix_flop = 2 * macs;

    work.bin.bytes_read = kSplatKeyBytes * listed;
    work.bin.bytes_written = kPairBytes * pairs;

    if (sorts_apart)
        work.sort.bytes_read = work.sort.bytes_written = kPairBytes * pairs;

    work.blend.bytes_read = (anchor.splat_bytes + (sorts_apart ? kIndexBytes : kPairBytes)) * pairs * (shared ? 2 : 1);
    work.blend.bytes_written = kPixelBytes * pixels * eye_count;
    work.blend.lane_operations = kLanesPerEvaluation * evaluations;
    work.blend.exponentials = evaluations;
    return work;
}

const char* boundName(Bound bound)
{
    switch (bound) {
    case Bound::None:
        return "none";
    case Bound::Memory:
        return "memory";
    case Bound::Lanes:
        return "lanes";
    case Bound::Exponentials:
        return "exponentials";
    case Bound::Matrix:
        return "matrix";
    }
    return "none";
}

StageFloor floorOf(const StageWork& work, const DeviceCeilings& ceilings)
{
    const double read = 1 / ceilings.read_bytes_per_s; // seconds per byte
    // seconds that a written byte adds, such that equal amounts take the copy ceiling
    const double write = std::max(2 / ceilings.copy_bytes_per_s - read, 0.0);
    const struct {
        Bound bound;
        double seconds;
    } limits[] = {
        {Bound::Memory, work.bytes_read * read + work.bytes_written * write},
        {Bound::Lanes, work.lane_operations / ceilings.fma_lane_ops_per_s},
        {Bound::Exponentials, work.exponentials / ceilings.exp_per_s},
        {Bound::Matrix, work.matrix_flop / ceilings.mma_flop_per_s},
    };
    StageFloor floor;
    for (const auto& limit : limits)
        if (limit.seconds * 1000 > floor.ms)
            floor = {limit.seconds * 1000, limit.bound};
    return floor;
}

} // namespace gsc
