// SPDX-License-Identifier: Apache-2.0
// Packs and draws strips on a CPU. Lanes are anchors while a strip is packed, Gaussians while it is drawn.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/reuse/packed_strip_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/reuse/packed_strip.h"

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;
using DInt = hn::RebindToSigned<D>;

// Rows of PackScratch while a strip is packed; the Gaussians that can be visible lie in them without gaps.
enum PackRow : uint32_t { kPosition = 0, kFirst = 3, kSecond = kFirst + kStripRows, kPackRows = kSecond + kStripRows };

HWY_INLINE V loadHalf(const uint16_t* from)
{
    return hn::PromoteTo(D(), hn::LoadU(DHalf(), reinterpret_cast<const hwy::float16_t*>(from)));
}

HWY_INLINE V loadSteps(const int8_t* from)
{
    const hn::Rebind<int8_t, D> d8;
    return hn::ConvertTo(D(), hn::PromoteTo(DInt(), hn::LoadU(d8, from)));
}

// Unit in which the scales of a strip are stored as half floats: a power of two for which the largest one still fits,
// so that small ones keep the most digits.
HWY_INLINE float scaleUnit(const StripPack& pack)
{
    const float* base = pack.fixed + size_t(3) * kStripAnchors * pack.n_offsets;
    const D d;
    V largest = hn::Zero(d);
    for (size_t i = 0; i < 3 * kStripAnchors; i += hn::Lanes(d))
        largest = hn::Max(largest, hn::LoadU(d, base + i));
    const float most = hn::GetLane(hn::MaxOfLanes(d, largest));
    int exponent = 0;
    if (most > 0 && std::isfinite(most))
        std::frexp(most, &exponent);
    return std::ldexp(1.0f, std::clamp(exponent - 15, -100, 100));
}

// Appends to the rows the Gaussians of offset k that can be visible somewhere between or beyond the keys; of the lanes
// from `first` on.
template <bool kTwo>
HWY_INLINE void gatherLiving(const StripPack& pack, uint32_t k, uint32_t first, V to_unit, PackedStrip& head,
                             PackScratch& scratch, size_t& count)
{
    const D d;
    const size_t at = size_t(kStripRows) * kStripAnchors * k + first;
    const uint16_t *a = pack.keys[0] + at, *b = kTwo ? pack.keys[1] + at : nullptr;
    const M valid = maskOf(((1u << pack.count) - 1) >> first);
    const V opacity = loadHalf(a), zero = hn::Zero(d);
    head.positive[0] = uint16_t(head.positive[0] | maskBits(hn::And(valid, hn::Gt(opacity, zero))) << first);
    V most = opacity, least = opacity;
    if constexpr (kTwo) {
        const V last = loadHalf(b);
        least = hn::Min(opacity, last);
        head.positive[1] = uint16_t(head.positive[1] | maskBits(hn::And(valid, hn::Gt(last, zero))) << first);
        const V way = hn::Sub(last, opacity);
        const V before = hn::MulAdd(hn::Set(d, kLeastMix), way, opacity);
        // opacity is largest at an end, since it is linear between the keys
        most = hn::Max(before, hn::MulAdd(hn::Set(d, kMostMix), way, opacity));
    }
    const M shows = hn::And(hn::Ge(most, hn::Set(d, kOpacityFloor)), hn::Gt(least, hn::Set(d, kNoOpacity)));
    const M alive = hn::And(valid, shows);
    if (hn::AllFalse(d, alive))
        return;
    const size_t stride = packStride(pack.n_offsets);
    float* rows = scratch.rows.data() + count;
    const auto append = [&](V v, uint32_t row) { hn::StoreU(hn::Compress(v, alive), d, rows + row * stride); };
    const float* base = pack.fixed + size_t(3) * kStripAnchors * pack.n_offsets + first;
    for (uint32_t i = 0; i < 3; ++i)
        append(hn::LoadU(d, pack.fixed + (size_t(3) * k + i) * kStripAnchors + first), kPosition + i);
    for (uint32_t row = 0; row < kStripRows; ++row) {
        V v = loadHalf(a + row * kStripAnchors), w = kTwo ? loadHalf(b + row * kStripAnchors) : v;
        if (row >= kScaleRow && row < kRotationRow) {
            const V extent = hn::Mul(hn::LoadU(d, base + size_t(row - kScaleRow) * kStripAnchors), to_unit);
            v = hn::Mul(v, extent);
            w = hn::Mul(w, extent);
            // at least a quarter of the second key's scale: differences are relative to the first key, and that of a
            // Gaussian that grows from almost nothing would make the steps of its whole cell coarse
            v = hn::Max(v, hn::Mul(w, hn::Set(d, 0.25f)));
        }
        append(v, kFirst + row);
        if constexpr (kTwo)
            append(w, kSecond + row);
    }
    const DInt di;
    const hn::Rebind<uint16_t, D> du16;
    const auto origin = hn::Add(hn::Iota(di, 0), hn::Set(di, int32_t(k * kStripAnchors + first)));
    const auto kept = hn::BitCast(di, hn::Compress(hn::BitCast(d, origin), alive));
    hn::StoreU(hn::DemoteTo(du16, kept), du16, scratch.origins.data() + count);
    count += hn::CountTrue(d, alive);
}

// Stores the differences of `count` rows as steps in `to`. Returns the size of a step.
HWY_INLINE float storeSteps(float (*difference)[kCellGaussians], uint32_t count, int8_t (*to)[kCellGaussians])
{
    const D d;
    const hn::Rebind<int8_t, D> d8;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    V most = hn::Zero(d);
    for (uint32_t row = 0; row < count; ++row)
        for (uint32_t i = 0; i < kCellGaussians; i += lanes)
            most = hn::Max(hn::Abs(hn::Load(d, difference[row] + i)), most);
    const float largest = hn::GetLane(hn::MaxOfLanes(d, most));
    const bool some = largest > 1e-20f && largest < 1e20f;
    const V inverse = hn::Set(d, some ? 127.0f / largest : 0.0f);
    for (uint32_t row = 0; row < count; ++row)
        for (uint32_t i = 0; i < kCellGaussians; i += lanes) {
            const auto steps = hn::NearestInt(hn::Mul(hn::Load(d, difference[row] + i), inverse));
            hn::StoreU(hn::DemoteTo(d8, steps), d8, to[row] + i);
        }
    return some ? largest / 127.0f : 0.0f;
}

HWY_INLINE void storeSecond(const float* rows, size_t stride, SecondCell& cell)
{
    const D d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    HWY_ALIGN float difference[kStripRows][kCellGaussians];
    for (uint32_t row = 0; row < kStripRows; ++row)
        for (uint32_t i = 0; i < kCellGaussians; i += lanes) {
            const V a = hn::LoadU(d, rows + (kFirst + row) * stride + i);
            const V b = hn::LoadU(d, rows + (kSecond + row) * stride + i);
            V v = hn::Sub(b, a);
            if (row == kOpacityRow)
                storeHalf(b, cell.opacity + i);
            if (row >= kScaleRow && row < kRotationRow)
                v = hn::Mul(v, reciprocal(d, hn::Max(a, hn::Set(d, 1e-20f))));
            hn::Store(v, d, difference[row] + i);
        }
    cell.color_step = storeSteps(difference + kColorRow, 3, cell.key + kColorRow - 1);
    cell.scale_step = storeSteps(difference + kScaleRow, 3, cell.key + kScaleRow - 1);
    cell.rotation_step = storeSteps(difference + kRotationRow, 4, cell.key + kRotationRow - 1);
    cell.reserved = 0;
}

HWY_INLINE void storeFirst(const float* rows, size_t stride, const uint16_t* origins, FirstCell& cell)
{
    const D d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    for (uint32_t i = 0; i < kCellGaussians; i += lanes) {
        for (uint32_t axis = 0; axis < 3; ++axis)
            hn::Store(hn::LoadU(d, rows + (kPosition + axis) * stride + i), d, cell.position[axis] + i);
        for (uint32_t row = 0; row < kStripRows; ++row)
            storeHalf(hn::LoadU(d, rows + (kFirst + row) * stride + i), cell.key[row] + i);
    }
    std::copy_n(origins, kCellGaussians, cell.origin);
}

// Fills up the last cell with Gaussians of opacity -1 at both keys; their other values are 0.
void fillUp(uint32_t n_offsets, size_t count, PackScratch& scratch)
{
    const size_t stride = packStride(n_offsets);
    for (uint32_t row = 0; row < kPackRows; ++row) {
        const bool opacity = row == kFirst + kOpacityRow || row == kSecond + kOpacityRow;
        std::fill_n(scratch.rows.data() + row * stride + count, kCellGaussians, opacity ? -1.0f : 0.0f);
    }
    std::fill_n(scratch.origins.data() + count, kCellGaussians, uint16_t(0));
}

template <bool kTwo>
uint32_t packKeys(const StripPack& pack, PackScratch& scratch, std::byte* packed)
{
    const D d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    PackedStrip& head = *reinterpret_cast<PackedStrip*>(packed);
    head = {};
    head.scale_unit = scaleUnit(pack);
    const V to_unit = hn::Set(d, 1 / head.scale_unit);
    size_t count = 0;
    for (uint32_t k = 0; k < pack.n_offsets; ++k)
        for (uint32_t first = 0; first < kStripAnchors; first += lanes)
            gatherLiving<kTwo>(pack, k, first, to_unit, head, scratch, count);
    fillUp(pack.n_offsets, count, scratch);
    const size_t stride = packStride(pack.n_offsets);
    head.cells = uint32_t((count + kCellGaussians - 1) / kCellGaussians);
    auto* first_cells = reinterpret_cast<FirstCell*>(packed + sizeof(PackedStrip));
    auto* second_cells = reinterpret_cast<SecondCell*>(first_cells + head.cells);
    for (uint32_t c = 0; c < head.cells; ++c) {
        const float* rows = scratch.rows.data() + size_t(c) * kCellGaussians;
        storeFirst(rows, stride, scratch.origins.data() + size_t(c) * kCellGaussians, first_cells[c]);
        if constexpr (kTwo)
            storeSecond(rows, stride, second_cells[c]);
    }
    return head.cells;
}

uint32_t packStrip(const StripPack& pack, PackScratch& scratch, std::byte* packed)
{
    return pack.keys[1] != nullptr ? packKeys<true>(pack, scratch, packed) : packKeys<false>(pack, scratch, packed);
}

// Parameters with which a strip is drawn in a frame, equal for all of its cells.
struct Mixing {
    V t, unit;
    uint32_t lanes;
    const float* fraction;
    uint32_t n_offsets, first_origin;
};

// Values of a cell's Gaussians from Gaussian i on, at the place between the keys.
template <bool kTwo>
struct MixedCell {
    const FirstCell& a;
    const SecondCell* b;
    V t;
    uint32_t i;

    HWY_INLINE V opacity() const
    {
        const V first = loadHalf(a.key[kOpacityRow] + i);
        if constexpr (!kTwo)
            return first;
        return hn::MulAdd(t, hn::Sub(loadHalf(b->opacity + i), first), first);
    }
    // Values of a row between both keys. `weight`: factor of the stored difference; relative: the difference is a share
    // of the first key's value.
    HWY_INLINE V operator()(uint32_t row, V weight, bool relative = false) const
    {
        const V first = loadHalf(a.key[row] + i);
        if constexpr (!kTwo)
            return first;
        return hn::MulAdd(relative ? hn::Mul(weight, first) : weight, loadSteps(b->key[row - 1] + i), first);
    }
    HWY_INLINE V weight(float SecondCell::*step) const
    {
        return kTwo ? hn::Mul(t, hn::Set(D(), b->*step)) : hn::Zero(D());
    }
};

// Appends the visible Gaussians of a vector to `block`. `put` stores their values in an array.
template <bool kTwo, class Put>
HWY_INLINE void appendCell(const Mixing& mixing, const MixedCell<kTwo>& cell, V opacity, const GaussianBlock& block,
                           Put&& put)
{
    const D d;
    const V color = cell.weight(&SecondCell::color_step), scale = cell.weight(&SecondCell::scale_step);
    const V rotation = cell.weight(&SecondCell::rotation_step);
    for (uint32_t i = 0; i < 3; ++i) {
        put(hn::Load(d, cell.a.position[i] + cell.i), block.position[i]);
        put(hn::Mul(cell(kScaleRow + i, scale, true), mixing.unit), block.scale[i]);
        put(cell(kColorRow + i, color), block.color[i]);
    }
    V q[4];
    for (uint32_t i = 0; i < 4; ++i)
        q[i] = cell(kRotationRow + i, rotation);
    // note: normalised again even with one key, because of the rounding to half floats
    const V norm = hn::MulAdd(q[0], q[0], hn::MulAdd(q[1], q[1], hn::MulAdd(q[2], q[2], hn::Mul(q[3], q[3]))));
    const V inverse = reciprocalSqrt(d, hn::Max(norm, hn::Set(d, 1e-12f)));
    for (int i = 0; i < 4; ++i)
        put(hn::Mul(q[i], inverse), block.rotation[i]);
    put(opacity, block.opacity);
}

template <bool kTwo>
HWY_INLINE void mixCell(const Mixing& mixing, const FirstCell& a, const SecondCell* b, GaussianBlock& block)
{
    const D d;
    const DInt di;
    const hn::Rebind<uint16_t, D> du16;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    for (uint32_t i = 0; i < kCellGaussians; i += lanes) {
        const MixedCell<kTwo> cell{a, b, mixing.t, i};
        const auto packed = hn::PromoteTo(di, hn::LoadU(du16, a.origin + i));
        const auto anchor = hn::And(packed, hn::Set(di, int32_t(kStripAnchors - 1)));
        V opacity = cell.opacity();
        if (mixing.fraction != nullptr)
            opacity = hn::Mul(opacity, hn::GatherIndex(d, mixing.fraction, anchor));
        M alive = hn::Ge(opacity, hn::Set(d, kOpacityFloor));
        if (mixing.lanes != 0xffff) {
            const auto bit = hn::And(hn::Shr(hn::Set(di, int32_t(mixing.lanes)), anchor), hn::Set(di, 1));
            alive = hn::And(alive, hn::RebindMask(d, hn::Ne(bit, hn::Zero(di))));
        }
        const auto offset = hn::ShiftRight<4>(packed);
        const auto origin = hn::Add(hn::Add(hn::Mul(anchor, hn::Set(di, int32_t(mixing.n_offsets))), offset),
                                    hn::Set(di, int32_t(mixing.first_origin)));
        const size_t at = block.count;
        if (hn::AllTrue(d, alive)) {
            appendCell(mixing, cell, opacity, block, [&](V v, float* to) { hn::StoreU(v, d, to + at); });
            hn::StoreU(hn::DemoteTo(du16, origin), du16, block.origin + at);
            block.count += lanes;
        } else if (!hn::AllFalse(d, alive)) {
            appendCell(mixing, cell, opacity, block,
                       [&](V v, float* to) { hn::StoreU(hn::Compress(v, alive), d, to + at); });
            const auto kept = hn::BitCast(di, hn::Compress(hn::BitCast(d, origin), alive));
            hn::StoreU(hn::DemoteTo(du16, kept), du16, block.origin + at);
            block.count += uint32_t(hn::CountTrue(d, alive));
        }
    }
}

template <bool kTwo>
void mixCells(const StripMix& mix, GaussianBlock& result)
{
    const D d;
    const PackedStrip& head = *reinterpret_cast<const PackedStrip*>(mix.packed);
    const auto* first = reinterpret_cast<const FirstCell*>(mix.packed + sizeof(PackedStrip));
    const auto* second = reinterpret_cast<const SecondCell*>(first + head.cells);
    const Mixing mixing{hn::Set(d, mix.t), hn::Set(d, head.scale_unit), mix.lanes, mix.fraction, mix.n_offsets,
                        mix.first_origin};
    // note: a local copy; otherwise the compiler must assume that stores through its pointers change it
    GaussianBlock block = result;
    for (uint32_t c = 0, cells = head.cells; c < cells; ++c)
        mixCell<kTwo>(mixing, first[c], kTwo ? second + c : nullptr, block);
    result.count = block.count;
}

void mixStrip(const StripMix& mix, GaussianBlock& block)
{
    if (mix.t != 0)
        mixCells<true>(mix, block);
    else
        mixCells<false>(mix, block);
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(packStrip);
HWY_EXPORT(mixStrip);

void reservePack(uint32_t n_offsets, PackScratch& scratch)
{
    const size_t stride = packStride(n_offsets);
    scratch.rows.reserve((3 + 2 * kStripRows) * stride);
    scratch.origins.reserve(stride);
}

PackedExtent packStripCpu(const StripPack& pack, PackScratch& scratch, std::byte* packed)
{
    const uint32_t cells = HWY_DYNAMIC_DISPATCH(packStrip)(pack, scratch, packed);
    const auto one = uint32_t(sizeof(PackedStrip) + cells * sizeof(FirstCell));
    return {one, one + (pack.keys[1] != nullptr ? uint32_t(cells * sizeof(SecondCell)) : 0)};
}

void mixStripCpu(const StripMix& mix, GaussianBlock& block)
{
    const PackedStrip& head = *reinterpret_cast<const PackedStrip*>(mix.packed);
    uint32_t positive = mix.lanes & (head.positive[0] | (mix.t != 0 ? head.positive[1] : 0u));
    for (uint32_t lane = 0; mix.fraction != nullptr && lane < kStripAnchors; ++lane)
        if (!(mix.fraction[lane] > 0))
            positive &= ~(1u << lane);
    block.any_positive |= positive != 0;
    HWY_DYNAMIC_DISPATCH(mixStrip)(mix, block);
}

} // namespace gsc
#endif
