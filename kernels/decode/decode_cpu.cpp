// SPDX-License-Identifier: Apache-2.0
// Decodes on a CPU with one anchor in each lane: a weight is broadcast once per vector of anchors and multiplied with
// all of them, so no sums across lanes are needed, and the networks need no padded batch.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/decode/decode_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "kernels/decode/decode_batch-inl.h"

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;

// Appends Gaussian k of each anchor whose lane is set in `alive` (format facts 4.4).
HWY_INLINE void emitOffset(const DecodeArgs& args, const PackedMlpHeader& packed, const Batch& batch, uint32_t k,
                           V opacity, M alive, hn::Vec<hn::RebindToSigned<D>> origin, GaussianBlock& block)
{
    const D d;
    const uint32_t H = packed.hidden_pad;
    V head[kCovariancePerOffset + kColorPerOffset];
    offsetHeads(d, *args.model, packed, batch.hidden + size_t(H) * kMaxLanes, batch.hidden + size_t(2 * H) * kMaxLanes,
                k, head);
    const size_t at = block.count;
    const auto append = [&](V v, float* to) { hn::StoreU(hn::Compress(v, alive), d, to + at); };
    for (int i = 0; i < 3; ++i) {
        const V offset = hn::Load(d, batch.offset + (size_t(3) * k + size_t(i)) * kMaxLanes);
        const V extent = hn::Load(d, batch.scale + i * kMaxLanes);
        // note: rounds twice, as the trainers' code, which multiplies and adds in separate kernels
        append(hn::Add(hn::Load(d, batch.position + i * kMaxLanes), hn::Mul(offset, extent)), block.position[i]);
        append(hn::Mul(hn::Load(d, batch.scale + (3 + i) * kMaxLanes), sigmoidAny(d, head[i])), block.scale[i]);
        append(sigmoidAny(d, head[kCovariancePerOffset + i]), block.color[i]);
    }
    V norm = hn::Mul(head[3], head[3]);
    for (int i = 4; i < 7; ++i)
        norm = hn::Add(norm, hn::Mul(head[i], head[i]));
    norm = hn::Sqrt(norm);
    const V tiny = hn::Set(d, 1e-12f);
    norm = hn::IfThenElse(hn::Lt(norm, tiny), tiny, norm);
    // an exact division, since an approximation fails for numbers as small as 1e-12
    const V inverse = hn::Div(hn::Set(d, 1.0f), norm);
    for (int i = 0; i < 4; ++i)
        append(hn::Mul(head[3 + i], inverse), block.rotation[i]);
    append(opacity, block.opacity);
    const hn::RebindToSigned<D> di;
    const hn::Rebind<uint16_t, D> du16;
    const auto numbered = hn::Add(origin, hn::Set(di, int32_t(k)));
    const auto kept = hn::BitCast(di, hn::Compress(hn::BitCast(d, numbered), alive));
    hn::StoreU(hn::DemoteTo(du16, kept), du16, block.origin + at);
    block.count += uint32_t(hn::CountTrue(d, alive));
}

// Decodes all Gaussians of a vector of anchors for one eye.
void decodeEye(const DecodeArgs& args, const PackedMlpHeader& packed, const VisibleAnchor* visible, uint32_t eye,
               uint32_t first_entry, const Batch& batch, GaussianBlock& block)
{
    const D d;
    const ModelView& model = *args.model;
    const ModelParams& params = *model.params;
    const uint32_t K = params.n_offsets;
    HWY_ALIGN float fraction[kMaxLanes] = {};
    uint64_t seen = 0;
    for (uint32_t lane = 0; lane < batch.count; ++lane)
        if (visible[lane].eyes >> eye & 1) {
            fraction[lane] = visible[lane].fraction[eye];
            seen = 1;
        }
    if (seen == 0)
        return;
    hiddenLayers(args, packed, args.eyes[eye].center, batch);

    const V weight = hn::Load(d, fraction); // zero if the eye does not see the anchor, which drops its Gaussians
    const V floor = hn::Set(d, kOpacityFloor);
    const hn::RebindToSigned<D> di;
    // GaussianBlock::origin of slot 0 of each anchor
    const auto origin = hn::Mul(hn::Iota(di, int32_t(first_entry)), hn::Set(di, int32_t(K)));
    const bool masks = (params.flags & kModelMaskedSlots) != 0;
    M positive = hn::Lt(floor, hn::Zero(d));
    for (uint32_t k = 0; k < K; ++k) {
        const V raw = hn::Load(d, batch.opacity + size_t(k) * kMaxLanes);
        const V opacity = hn::Mul(tanhAny(d, raw), weight);
        positive = hn::Or(positive, hn::Gt(opacity, hn::Zero(d)));
        M alive = hn::Ge(opacity, floor);
        if (masks) {
            const V x = hn::Load(d, batch.offset + size_t(3) * k * kMaxLanes); // NaN if the slot is masked
            alive = hn::And(alive, hn::Eq(x, x));
        }
        if (!hn::AllFalse(d, alive))
            emitOffset(args, packed, batch, k, opacity, alive, origin, block);
    }
    block.any_positive |= !hn::AllFalse(d, positive);
}

void decodeBlock(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch)
{
    const D d;
    const ModelView& model = *args.model;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    Batch batch = carve(*model.params, packed, scratch.values.data());
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        scratch.blocks[e].count = 0;
        scratch.blocks[e].any_positive = false;
    }
    for (uint32_t entry = 0; entry < count; entry += lanes) {
        const VisibleAnchor* visible = args.visible + first + entry;
        batch.count = std::min(lanes, count - entry);
        gather(model, visible, batch);
        // note: prefetches across the end of the block, since this worker likely takes the next block; but not past the
        // end of the list
        const size_t next = first + entry + lanes;
        if (next < args.visible_count)
            prefetch(model, args.visible + next, uint32_t(std::min<size_t>(lanes, args.visible_count - next)));
        sharedLayer(args, packed, batch);
        for (uint32_t e = 0; e < args.eye_count; ++e)
            decodeEye(args, packed, visible, e, entry, batch, scratch.blocks[e]);
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(decodeBlock);

DecodeArgs prepareDecode(const ModelView& model, const EyeParams* eyes, uint32_t eye_count,
                         const VisibleAnchor* visible, size_t visible_count, int32_t appearance, Buffer<float>& bias)
{
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const uint32_t columns = 3 * packed.hidden_pad, A = model.params->appearance_dim;
    bias.reserve(columns);
    std::copy_n(packedWeights(model, packed.first_bias_f32), columns, bias.data());
    if (model.embedding != nullptr && appearance >= 0) {
        const float* row = model.embedding + size_t(appearance) * A;
        const float* weights =
            packedWeights(model, packed.first_f32) + size_t(model.params->feat_dim + kViewRows) * columns;
        for (uint32_t a = 0; a < A; ++a)
            for (uint32_t c = 0; c < columns; ++c)
                bias[c] += row[a] * weights[size_t(a) * columns + c];
    }
    const MlpRecord* const bank = mlpRecord(model, MlpKind::FeatureBank);
    DecodeArgs args{&model, eyes, eye_count, visible, visible_count, bank, bias.data(), false, false};
    for (const MlpKind head : {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color}) {
        args.takes_distance |= (mlpRecord(model, head)->inputs & kMlpTakesDistance) != 0;
        args.takes_level |= (mlpRecord(model, head)->inputs & kMlpTakesLevel) != 0;
    }
    return args;
}

void reserveDecode(const ModelView& model, DecodeScratch& scratch)
{
    const ModelParams& params = *model.params;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const size_t F = params.feat_dim, K = params.n_offsets;
    const size_t rows = 2 * (F + kViewRows) + 6 * packed.hidden_pad + packed.out_pad[0] + 3 * K + 3 + 6 + 1;
    reserveBlocks(kDecodeBlock * K, rows * kMaxLanes, scratch);
}

void reserveBlocks(size_t gaussians, size_t own_values, DecodeScratch& scratch)
{
    // room for a vector more: a compressed store may write a whole vector behind the last value
    const size_t capacity = gaussians + kMaxLanes;
    constexpr size_t kArrays = 14;
    scratch.values.reserve(own_values + kMaxEyes * kArrays * capacity);
    scratch.origins.reserve(kMaxEyes * capacity);
    float* values = scratch.values.data() + own_values;
    const auto take = [&values, capacity] {
        float* p = values;
        values += capacity;
        return p;
    };
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        GaussianBlock& block = scratch.blocks[e];
        for (int i = 0; i < 3; ++i) {
            block.position[i] = take();
            block.scale[i] = take();
            block.color[i] = take();
        }
        for (float*& p : block.rotation)
            p = take();
        block.opacity = take();
        block.origin = scratch.origins.data() + e * capacity;
    }
}

void decodeBlockCpu(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch)
{
    HWY_DYNAMIC_DISPATCH(decodeBlock)(args, first, count, scratch);
}

} // namespace gsc
#endif
