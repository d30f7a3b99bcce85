// SPDX-License-Identifier: Apache-2.0
// Decodes strips on a CPU; each lane takes an anchor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/reuse/strip_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/decode/decode_batch-inl.h"
#include "kernels/reuse/strip.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;

// Writes positions and base scales for a vector of anchors, which begins at anchor `first` of the strip.
HWY_INLINE void storeFixed(const Batch& batch, uint32_t K, uint32_t first, float* fixed)
{
    const D d;
    for (uint32_t row = 0; row < 3 * K; ++row) {
        const uint32_t axis = row % 3;
        const V offset = hn::Load(d, batch.offset + size_t(row) * kMaxLanes);
        const V extent = hn::Load(d, batch.scale + axis * kMaxLanes);
        // note: rounds twice, as decodeBlockCpu() does
        hn::StoreU(hn::Add(hn::Load(d, batch.position + axis * kMaxLanes), hn::Mul(offset, extent)), d,
                   fixed + size_t(row) * kStripAnchors + first);
    }
    for (uint32_t axis = 0; axis < 3; ++axis)
        hn::StoreU(hn::Load(d, batch.scale + (3 + axis) * kMaxLanes), d,
                   fixed + (size_t(3) * K + axis) * kStripAnchors + first);
}

// Writes offset k of a vector of anchors: kStripRows rows from `key` on.
HWY_INLINE void storeOffset(const DecodeArgs& args, const PackedMlpHeader& packed, const Batch& batch, uint32_t k,
                            V opacity, uint16_t* key)
{
    const D d;
    const size_t H = size_t(packed.hidden_pad) * kMaxLanes;
    V head[kCovariancePerOffset + kColorPerOffset];
    offsetHeads(d, *args.model, packed, batch.hidden + H, batch.hidden + 2 * H, k, head);
    M drawn = hn::Eq(opacity, opacity);
    if ((args.model->params->flags & kModelMaskedSlots) != 0) {
        const V x = hn::Load(d, batch.offset + size_t(3) * k * kMaxLanes); // NaN if the slot is masked
        drawn = hn::And(drawn, hn::Eq(x, x));
    }
    storeHalf(hn::IfThenElse(drawn, opacity, hn::Set(d, kNoOpacity)), key);
    for (size_t i = 0; i < 3; ++i) {
        storeHalf(sigmoidAny(d, head[kCovariancePerOffset + i]), key + (1 + i) * kStripAnchors);
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
                const V opacity = tanhAny(d, hn::Load(d, batch.opacity + size_t(k) * kMaxLanes));
                storeOffset(args, packed, batch, k, opacity, keys[e] + size_t(kStripRows) * kStripAnchors * k + first);
            }
        }
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(decodeStrip);

void decodeStripCpu(const DecodeArgs& args, uint32_t count, uint16_t* const* keys, float* fixed, DecodeScratch& scratch)
{
    HWY_DYNAMIC_DISPATCH(decodeStrip)(args, count, keys, fixed, scratch);
}

} // namespace gsc
#endif
