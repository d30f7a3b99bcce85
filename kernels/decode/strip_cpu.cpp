// SPDX-License-Identifier: Apache-2.0
// Lanes are anchors.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/decode/strip_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/decode/decode_batch-inl.h"
#include "kernels/decode/strip.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;
using DHalf = hn::Rebind<hwy::float16_t, D>;

HWY_INLINE void storeHalf(V v, uint16_t* to)
{
    hn::StoreU(hn::DemoteTo(DHalf(), v), DHalf(), reinterpret_cast<hwy::float16_t*>(to));
}

HWY_INLINE V loadHalf(const uint16_t* from)
{
    return hn::PromoteTo(D(), hn::LoadU(DHalf(), reinterpret_cast<const hwy::float16_t*>(from)));
}

// Positions and base scales of the anchors of a batch that starts at lane `first` of the strip.
HWY_INLINE void storeFixed(const Batch& batch, uint32_t K, uint32_t first, float* fixed)
{
    const D d;
    for (uint32_t row = 0; row < 3 * K; ++row) {
        const uint32_t axis = row % 3;
        const V offset = hn::Load(d, batch.offset + size_t(row) * kMaxLanes);
        const V extent = hn::Load(d, batch.scale + axis * kMaxLanes);
        // note: two roundings, as in decodeBlockCpu()
        hn::StoreU(hn::Add(hn::Load(d, batch.position + axis * kMaxLanes), hn::Mul(offset, extent)), d,
                   fixed + size_t(row) * kStripAnchors + first);
    }
    for (uint32_t axis = 0; axis < 3; ++axis)
        hn::StoreU(hn::Load(d, batch.scale + (3 + axis) * kMaxLanes), d,
                   fixed + (size_t(3) * K + axis) * kStripAnchors + first);
}

// One offset of a batch: kStripRows rows from `key` on.
HWY_INLINE void storeOffset(const DecodeArgs& args, const PackedMlpHeader& packed, const Batch& batch, uint32_t k,
                            V opacity, uint16_t* key)
{
    const D d;
    const size_t H = size_t(packed.hidden_pad) * kMaxLanes;
    V head[kCovariancePerOffset + kColorPerOffset];
    offsetHeads(d, *args.model, packed, batch.hidden + H, batch.hidden + 2 * H, k, head);
    storeHalf(opacity, key);
    for (size_t i = 0; i < 3; ++i) {
        const V color = activateVector(Activation(args.networks.color->activation), head[kCovariancePerOffset + i]);
        storeHalf(color, key + (1 + i) * kStripAnchors);
        storeHalf(sigmoidAny(d, head[i]), key + (4 + i) * kStripAnchors);
    }
    V norm = hn::Mul(head[3], head[3]);
    for (int i = 4; i < 7; ++i)
        norm = hn::MulAdd(head[i], head[i], norm);
    norm = hn::Sqrt(norm);
    const V tiny = hn::Set(d, 1e-12f);
    const V inverse = hn::Div(hn::Set(d, 1.0f), hn::IfThenElse(hn::Lt(norm, tiny), tiny, norm));
    for (size_t i = 0; i < 4; ++i)
        storeHalf(hn::Mul(head[3 + i], inverse), key + (7 + i) * kStripAnchors);
}

void decodeStrip(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed, DecodeScratch& scratch)
{
    const D d;
    const ModelView& model = *args.model;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const uint32_t lanes = uint32_t(hn::Lanes(d)), K = model.params->n_offsets;
    Batch batch = carve(*model.params, packed, scratch.values.data());
    for (uint32_t first = 0; first < kStripAnchors; first += lanes) {
        const uint32_t entry = std::min(first, count - 1);
        batch.count = std::min(lanes, count - entry);
        gather(model, args.visible + entry, batch);
        storeFixed(batch, K, first, fixed);
        sharedLayer(args, packed, batch);
        for (uint32_t e = 0; e < args.eye_count; ++e) {
            hiddenLayers(args, packed, args.eyes[e].center, batch);
            for (uint32_t k = 0; k < K; ++k) {
                const V opacity = activateVector(Activation(args.networks.opacity->activation),
                                                 hn::Load(d, batch.opacity + size_t(k) * kMaxLanes));
                storeOffset(args, packed, batch, k, opacity, keys[e] + size_t(kStripRows) * kStripAnchors * k + first);
            }
        }
    }
}

// Rows of one offset at the place of the mix.
template <bool kTwo>
struct MixedRows {
    const uint16_t* a;
    const uint16_t* b;
    V t;

    HWY_INLINE V operator()(uint32_t row) const
    {
        const V first = loadHalf(a + row * kStripAnchors);
        if constexpr (!kTwo)
            return first;
        return hn::MulAdd(t, hn::Sub(loadHalf(b + row * kStripAnchors), first), first);
    }
};

template <bool kTwo>
HWY_INLINE void appendMixed(const StripMix& mix, const MixedRows<kTwo>& rows, uint32_t k, uint32_t first, V opacity,
                            M alive, GaussianBlock& block)
{
    const D d;
    const size_t at = block.count;
    const auto append = [&](V v, float* to) { hn::StoreU(hn::Compress(v, alive), d, to + at); };
    const float* base = mix.fixed + size_t(3) * kStripAnchors * mix.n_offsets + first;
    for (uint32_t i = 0; i < 3; ++i) {
        append(hn::LoadU(d, mix.fixed + (size_t(3) * k + i) * kStripAnchors + first), block.position[i]);
        append(hn::Mul(hn::LoadU(d, base + size_t(i) * kStripAnchors), rows(4 + i)), block.scale[i]);
        append(rows(1 + i), block.color[i]);
    }
    V q[4] = {rows(7), rows(8), rows(9), rows(10)};
    // note: normalised again even where nothing is mixed, because of the halves
    const V norm = hn::MulAdd(q[0], q[0], hn::MulAdd(q[1], q[1], hn::MulAdd(q[2], q[2], hn::Mul(q[3], q[3]))));
    const V inverse = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(hn::Max(norm, hn::Set(d, 1e-12f))));
    for (int i = 0; i < 4; ++i)
        append(hn::Mul(q[i], inverse), block.rotation[i]);
    append(opacity, block.opacity);
    const hn::RebindToSigned<D> di;
    const hn::Rebind<uint16_t, D> du16;
    const int32_t origin = int32_t(mix.first_origin + first * mix.n_offsets + k);
    const auto origins = hn::Add(hn::Mul(hn::Iota(di, 0), hn::Set(di, int32_t(mix.n_offsets))), hn::Set(di, origin));
    const auto kept = hn::BitCast(di, hn::Compress(hn::BitCast(d, origins), alive));
    hn::StoreU(hn::DemoteTo(du16, kept), du16, block.origin + at);
    block.count += uint32_t(hn::CountTrue(d, alive));
}

template <bool kTwo>
HWY_INLINE void mixLanes(const StripMix& given, GaussianBlock& result)
{
    // note: copies, so that stores through their pointers cannot be taken to change them
    const StripMix mix = given;
    GaussianBlock block = result;
    const D d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    const V floor = hn::Set(d, kOpacityFloor);
    for (uint32_t first = 0; first < kStripAnchors; first += lanes) {
        const uint8_t bits[8] = {uint8_t(mix.lanes >> first), uint8_t(mix.lanes >> first >> 8)};
        const M drawn = hn::LoadMaskBits(d, bits);
        if (hn::AllFalse(d, drawn))
            continue;
        const V factor = mix.fraction != nullptr ? hn::LoadU(d, mix.fraction + first) : hn::Set(d, 1.0f);
        for (uint32_t k = 0; k < mix.n_offsets; ++k) {
            const size_t at = size_t(kStripRows) * kStripAnchors * k + first;
            const MixedRows<kTwo> rows{mix.keys[0] + at, kTwo ? mix.keys[1] + at : nullptr, hn::Set(d, mix.t)};
            const V opacity = hn::Mul(rows(0), factor);
            block.any_positive |= !hn::AllFalse(d, hn::And(drawn, hn::Gt(opacity, hn::Zero(d))));
            const M alive = hn::And(drawn, hn::Ge(opacity, floor));
            if (!hn::AllFalse(d, alive))
                appendMixed(mix, rows, k, first, opacity, alive, block);
        }
    }
    result.count = block.count;
    result.any_positive = block.any_positive;
}

void mixStrip(const StripMix& mix, GaussianBlock& block)
{
    if (mix.t != 0)
        mixLanes<true>(mix, block);
    else
        mixLanes<false>(mix, block);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(decodeStrip);
HWY_EXPORT(mixStrip);

void decodeStripCpu(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed, DecodeScratch& scratch)
{
    HWY_DYNAMIC_DISPATCH(decodeStrip)(args, count, keys, fixed, scratch);
}

void mixStripCpu(const StripMix& mix, GaussianBlock& block)
{
    HWY_DYNAMIC_DISPATCH(mixStrip)(mix, block);
}

} // namespace gsc
#endif
