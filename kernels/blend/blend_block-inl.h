// SPDX-License-Identifier: Apache-2.0
// Blends a batch of a tile's splats into one vector of the tile's pixels, which stay in registers. Included once for
// each SIMD target.

#if defined(GSC_KERNELS_BLEND_BLOCK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_BLEND_BLOCK_INL_H
#undef GSC_KERNELS_BLEND_BLOCK_INL_H
#else
#define GSC_KERNELS_BLEND_BLOCK_INL_H
#endif

#include "kernels/blend/blend.h"
#include "kernels/bin/ellipse-inl.h"
#include "kernels/simd/simd_math-inl.h"

#include <hwy/contrib/math/math-inl.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

constexpr uint32_t kPixels = kTileSize * kTileSize;
constexpr uint32_t kBlock = 4;                     // width and height of a block in pixels
constexpr uint32_t kBlockPixels = kBlock * kBlock; // also the number of blocks in a tile
constexpr uint32_t kBatch = 32;   // number of splats whose touched blocks are found before the first of them is blended
using SplatList = uint32_t;       // one bit for each splat of a batch
constexpr uint32_t kTogether = 3; // splats whose falloffs are computed side by side, so that none waits for another

using M = hn::Mask<D>;

// Result that is wanted of blending a tile; Squares: BlendArgs::squares.
enum class Find { Colours, Depths, Cost, Squares };
constexpr bool findsDepths(Find find)
{
    return find == Find::Depths || find == Find::Cost;
}

// State of a tile while it is blended: block by block, rows of pixels in a block.
struct TileState {
    HWY_ALIGN float transmittance[kPixels];
    HWY_ALIGN float red[kPixels], green[kPixels], blue[kPixels];
    HWY_ALIGN float z[kPixels];                                   // depths of the pixels, if wanted
    HWY_ALIGN float block_x[kBlockPixels], block_y[kBlockPixels]; // place of the first pixel of each block
    HWY_ALIGN float place_x[kBlockPixels], place_y[kBlockPixels]; // places of a block's pixels, from its first pixel
    uint16_t undone[kBlockPixels];                                // for each block: bit i is set if pixel i is not done
    uint32_t live;                                                // bit b is set if some pixel of block b is not done
};

// A splat prepared for a tile. alpha is 2^(log_opacity - u^2 - w^2); u and w are linear in the pixel, so each is its
// value at the block's first pixel less a value that depends on the place in the block. Not valid for splats whose
// ellipse is not trusted (SplatBatch::loose).
struct alignas(64) Lit {
    float block_u[kBlockPixels], block_w[kBlockPixels]; // u and w at the first pixel of each block
    float place_u[kBlockPixels], place_w[kBlockPixels];
    float log_opacity, red, green, blue, z;
    const Splat* splat;
};

struct SplatBatch {
    Lit lits[kBatch];
    HWY_ALIGN uint16_t touched[kBatch]; // for each splat: bit b is set if it touches block b
    SplatList blocks[kBlockPixels];     // for each block: bit i is set if splat i touches the block
    SplatList loose;                    // bit i is set if the ellipse of splat i is not trusted
};

// Constants with which a picture is blended, equal for every splat.
struct BlendRules {
    float alpha_cap;
    float faintest; // logarithm to base 2 of the smallest alpha that is drawn
    float bound;    // transmittance: a pixel is done if it would fall below this
    bool gsplat;
    const OctaveTable& octave;
};

// Place of a vector of pixels in its tile.
struct PixelPlace {
    uint32_t block, part; // block: index of the first pixel of the block; part: first pixel of the vector in the block
};

// State of one vector of pixels while it is blended; `undone` tells which pixels are not done.
struct PixelLight {
    V transmittance, red, green, blue, z;
    M undone;
};

constexpr float kLog2E = 1.44269504f;
constexpr float kFaintest = -7.99435344f; // log2(kOpacityFloor), rounded

// Logarithm of an opacity to base 2; -1e30 for opacities below 1/255, which draw nothing.
HWY_INLINE V logOpacity(D d, V opacity)
{
    const V floor = hn::Set(d, kOpacityFloor);
    return hn::IfThenElse(hn::Ge(opacity, floor), hn::Log2(d, hn::Max(opacity, floor)), hn::Set(d, -1e30f));
}

// Logarithm to base 2 of a splat's alpha at the pixels of a vector.
HWY_INLINE V logAlpha(D d, const Lit& lit, PixelPlace at)
{
    const V u = hn::Sub(hn::Set(d, lit.block_u[at.block]), hn::Load(d, lit.place_u + at.part));
    const V w = hn::Sub(hn::Set(d, lit.block_w[at.block]), hn::Load(d, lit.place_w + at.part));
    return hn::NegMulAdd(w, w, hn::NegMulAdd(u, u, hn::Set(d, lit.log_opacity)));
}

// As logAlpha(), for a splat whose ellipse is not trusted: evaluates the form as the trainers' code does; -infinity
// where the power is positive.
HWY_INLINE V logAlphaLoose(D d, const Lit& lit, const TileState& state, PixelPlace at, bool gsplat)
{
    const Splat& splat = *lit.splat;
    const V x = hn::Add(hn::Set(d, state.block_x[at.block]), hn::Load(d, state.place_x + at.part));
    const V y = hn::Add(hn::Set(d, state.block_y[at.block]), hn::Load(d, state.place_y + at.part));
    const V dx = hn::Sub(hn::Set(d, splat.x), x), dy = hn::Sub(hn::Set(d, splat.y), y);
    const V half_a = hn::Set(d, -0.5f * splat.conic[0]), half_c = hn::Set(d, -0.5f * splat.conic[2]);
    // computes gaussianPower() with the same roundings, since halving is exact
    const V squares = hn::MulAdd(dx, hn::Mul(half_a, dx), hn::Mul(dy, hn::Mul(half_c, dy)));
    const V b_dx = hn::Mul(hn::Set(d, splat.conic[1]), dx);
    const V v = gsplat ? hn::NegMulAdd(b_dx, dy, squares) : hn::Sub(squares, hn::Mul(dy, b_dx));
    const V log_alpha = hn::MulAdd(v, hn::Set(d, kLog2E), hn::Set(d, lit.log_opacity));
    // false for NaN too, which draws nothing
    return hn::IfThenElse(hn::Le(v, hn::Zero(d)), log_alpha, hn::Set(d, -INFINITY));
}

HWY_INLINE void addSquares(D d, V weight, float* squares)
{
    hn::Store(hn::MulAdd(weight, weight, hn::Load(d, squares)), d, squares);
}

// Blends kCount splats, one behind the other, if they finish no pixel and none is the depth of a pixel. Returns false
// and does nothing otherwise. `squares`: sums per splat and lane, for Find::Squares.
template <Find kFind, uint32_t kCount>
HWY_INLINE bool blendTogether(D d, const BlendRules& rules, const Lit* const* lits, PixelPlace at, PixelLight& light,
                              float* const* squares)
{
    V log_alpha[kCount], weight[kCount];
    for (uint32_t i = 0; i < kCount; ++i)
        log_alpha[i] = logAlpha(d, *lits[i], at);
    exp2Steps<kCount>(d, rules.octave, log_alpha, weight);
    V t = light.transmittance;
    for (uint32_t i = 0; i < kCount; ++i) {
        const M drawn = hn::And(light.undone, hn::Ge(log_alpha[i], hn::Set(d, rules.faintest)));
        weight[i] = hn::IfThenElseZero(drawn, hn::Mul(t, hn::Min(hn::Set(d, rules.alpha_cap), weight[i])));
        t = hn::Sub(t, weight[i]);
    }
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::Lt(t, hn::Set(d, rules.bound)))))
        return false;
    if constexpr (findsDepths(kFind)) {
        const V half = hn::Set(d, kHalfLight);
        if (!hn::AllFalse(d, hn::And(hn::Ge(light.transmittance, half), hn::Lt(t, half))))
            return false;
    }
    for (uint32_t i = 0; i < kCount; ++i) {
        if constexpr (kFind == Find::Squares) {
            addSquares(d, weight[i], squares[i]);
            continue;
        }
        light.red = hn::MulAdd(weight[i], hn::Set(d, lits[i]->red), light.red);
        light.green = hn::MulAdd(weight[i], hn::Set(d, lits[i]->green), light.green);
        light.blue = hn::MulAdd(weight[i], hn::Set(d, lits[i]->blue), light.blue);
    }
    light.transmittance = t;
    return true;
}

// Blends one splat of any kind into pixels of any state. Returns the weights of the splat at these pixels.
HWY_NOINLINE V blendOne(const Lit& lit, bool loose, const BlendRules& rules, const TileState& state, PixelPlace at,
                        PixelLight& light)
{
    const D d;
    const V log_alpha = loose ? logAlphaLoose(d, lit, state, at, rules.gsplat) : logAlpha(d, lit, at);
    V alpha;
    exp2Steps<1>(d, rules.octave, &log_alpha, &alpha);
    const M drawn = hn::And(light.undone, hn::Ge(log_alpha, hn::Set(d, rules.faintest)));
    const V t = light.transmittance;
    const V taken = hn::IfThenElseZero(drawn, hn::Mul(t, hn::Min(hn::Set(d, rules.alpha_cap), alpha)));
    const V next = hn::Sub(t, taken);
    // the Gaussian that would bring the light below the bound is not drawn
    const M finishes = hn::Lt(next, hn::Set(d, rules.bound));
    const V weight = hn::IfThenZeroElse(finishes, taken);
    light.undone = hn::AndNot(finishes, light.undone);
    light.red = hn::MulAdd(weight, hn::Set(d, lit.red), light.red);
    light.green = hn::MulAdd(weight, hn::Set(d, lit.green), light.green);
    light.blue = hn::MulAdd(weight, hn::Set(d, lit.blue), light.blue);
    light.transmittance = hn::IfThenElse(finishes, t, next);
    const V half = hn::Set(d, kHalfLight);
    const M spent = hn::And(hn::Ge(t, half), hn::Lt(light.transmittance, half));
    light.z = hn::IfThenElse(spent, hn::Set(d, lit.z), light.z);
    return weight;
}

// Blends the splats in `list`, of a batch, into one vector of pixels. Returns the number of splats evaluated.
// `squares`: as for blendTogether(), for all splats of the batch.
template <Find kFind>
HWY_INLINE uint32_t blendVector(const SplatBatch& batch, const BlendRules& rules, SplatList list, PixelPlace at,
                                TileState& state, float (*squares)[kBlockPixels])
{
    const D d;
    const uint32_t first = at.block * kBlockPixels + at.part;
    PixelLight light = {hn::Load(d, state.transmittance + first),
                        hn::Load(d, state.red + first),
                        hn::Load(d, state.green + first),
                        hn::Load(d, state.blue + first),
                        findsDepths(kFind) ? hn::Load(d, state.z + first) : hn::Zero(d),
                        maskOf(uint32_t(state.undone[at.block]) >> at.part)};
    uint32_t visited = 0;
    bool undone = !hn::AllFalse(d, light.undone);
    static_assert(kTogether == 3);
    while (list != 0 && undone) {
        const Lit* lits[kTogether];
        float* sums[kTogether];
        uint32_t count = 0;
        SplatList these = list;
        do {
            if constexpr (kFind == Find::Squares)
                sums[count] = squares[std::countr_zero(list)];
            lits[count++] = batch.lits + std::countr_zero(list);
            list &= list - 1;
        } while (count < kTogether && list != 0);
        these ^= list;
        visited += count;
        bool easy = (these & batch.loose) == 0;
        if (HWY_LIKELY(easy))
            easy = count == 3   ? blendTogether<kFind, 3>(d, rules, lits, at, light, sums)
                   : count == 2 ? blendTogether<kFind, 2>(d, rules, lits, at, light, sums)
                                : blendTogether<kFind, 1>(d, rules, lits, at, light, sums);
        if (HWY_UNLIKELY(!easy)) {
            PixelLight careful = light; // note: a copy, whose address the call gets: `light` itself stays in registers
            for (uint32_t i = 0; i < count; ++i) {
                const bool loose = (batch.loose >> (lits[i] - batch.lits) & 1) != 0;
                const V weight = blendOne(*lits[i], loose, rules, state, at, careful);
                if constexpr (kFind == Find::Squares)
                    addSquares(d, weight, sums[i]);
            }
            light = careful;
            undone = !hn::AllFalse(d, light.undone);
        }
    }
    hn::Store(light.transmittance, d, state.transmittance + first);
    hn::Store(light.red, d, state.red + first);
    hn::Store(light.green, d, state.green + first);
    hn::Store(light.blue, d, state.blue + first);
    if constexpr (findsDepths(kFind))
        hn::Store(light.z, d, state.z + first);
    const uint32_t lanes = (1u << hn::Lanes(d)) - 1;
    const uint32_t others = state.undone[at.block] & ~(lanes << at.part);
    state.undone[at.block] = uint16_t(others | maskBits(light.undone) << at.part);
    return visited;
}

// Cholesky factors of the quadratic form of each splat in a batch, and bounds of u and w.
struct SplatFactors {
    HWY_ALIGN float u_x[kBatch], u_y[kBatch], w_y[kBatch]; // change of u and w from pixel to pixel
    HWY_ALIGN float least_u[kBatch], most_u[kBatch];       // range that u has over the pixels of a block
    HWY_ALIGN float reach[kBatch];                         // largest u^2 + w^2 at which alpha is 1/255 or more
};

// Finds the blocks in which splat i may be drawn, a bit each: those where the smallest u^2 and the smallest w^2 in the
// block, each by itself, leave alpha at 1/255 or more. That gives one per cent more blocks than the ellipse touches,
// but takes fewer operations.
HWY_INLINE uint32_t touchedBlocks(D d, const Lit& lit, const SplatFactors& f, uint32_t i)
{
    const V zero = hn::Zero(d), reach = hn::Set(d, f.reach[i]), most_w = hn::Set(d, float(kBlock - 1) * f.w_y[i]);
    const V least_u = hn::Set(d, f.least_u[i]), most_u = hn::Set(d, f.most_u[i]);
    uint32_t touched = 0;
    for (uint32_t b = 0; b < kBlockPixels; b += uint32_t(hn::Lanes(d))) {
        const V u = hn::Load(d, lit.block_u + b), w = hn::Load(d, lit.block_w + b);
        const V away_u = hn::Max(hn::Max(hn::Sub(u, most_u), hn::Sub(least_u, u)), zero);
        const V away_w = hn::Max(hn::Max(hn::Sub(w, most_w), hn::Neg(w)), zero);
        touched |= maskBits(hn::Le(hn::MulAdd(away_u, away_u, hn::Mul(away_w, away_w)), reach)) << b;
    }
    return touched;
}

// Prepares splats entries[0 .. count), count <= kBatch, and finds which blocks of the tile they touch. Meanwhile
// prefetches the splats of the next batch, up to entries[all].
HWY_INLINE void prepareBatch(const BlendArgs& args, const uint32_t* entries, uint32_t count, uint32_t all, bool depth,
                             const TileState& state, SplatBatch& batch)
{
    HWY_ALIGN float a[kBatch] = {}, b[kBatch] = {}, c[kBatch] = {}, opacity[kBatch] = {};
    batch.loose = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const Splat& s = args.splats[entries[i]];
        Lit& lit = batch.lits[i];
        lit.splat = &s;
        a[i] = s.conic[0];
        b[i] = s.conic[1];
        c[i] = s.conic[2];
        opacity[i] = s.opacity;
        lit.red = s.color[0];
        lit.green = s.color[1];
        lit.blue = s.color[2];
        lit.z = depth ? std::bit_cast<float>(args.sorted[entries[i]].depth_bits) : 0.0f;
        batch.loose |= SplatList(s.cutoff >= kLooseCutoff) << i;
    }
    const D d;
    SplatFactors f;
    HWY_ALIGN float log_opacity[kBatch];
    for (uint32_t i = 0; i < count; i += uint32_t(hn::Lanes(d))) {
        const V scale = hn::Set(d, 0.5f * kLog2E), zero = hn::Zero(d), side = hn::Set(d, float(kBlock - 1));
        const V root = hn::Sqrt(hn::Mul(scale, hn::Load(d, a + i)));
        const V lean = hn::Div(hn::Mul(scale, hn::Load(d, b + i)), root);
        const V logarithm = logOpacity(d, hn::Load(d, opacity + i));
        hn::Store(root, d, f.u_x + i);
        hn::Store(lean, d, f.u_y + i);
        hn::Store(hn::Sqrt(hn::NegMulAdd(lean, lean, hn::Mul(scale, hn::Load(d, c + i)))), d, f.w_y + i);
        hn::Store(hn::Mul(side, hn::Min(lean, zero)), d, f.least_u + i);
        hn::Store(hn::Mul(side, hn::Add(root, hn::Max(lean, zero))), d, f.most_u + i);
        // note: raised by as much as rounding may take from it
        hn::Store(hn::MulAdd(logarithm, hn::Set(d, 1.0001f), hn::Set(d, 1e-4f - 1.0001f * kFaintest)), d, f.reach + i);
        hn::Store(logarithm, d, log_opacity + i);
    }
    for (uint32_t i = 0; i < count; ++i) {
        if (i + kBatch < all)
            prefetchSplat(args.splats + entries[i + kBatch]);
        Lit& lit = batch.lits[i];
        lit.log_opacity = log_opacity[i];
        const V ux = hn::Set(d, f.u_x[i]), uy = hn::Set(d, f.u_y[i]), wy = hn::Set(d, f.w_y[i]);
        for (uint32_t p = 0; p < kBlockPixels; p += uint32_t(hn::Lanes(d))) {
            const V dx = hn::Sub(hn::Set(d, lit.splat->x), hn::Load(d, state.block_x + p));
            const V dy = hn::Sub(hn::Set(d, lit.splat->y), hn::Load(d, state.block_y + p));
            hn::Store(hn::MulAdd(ux, dx, hn::Mul(uy, dy)), d, lit.block_u + p);
            hn::Store(hn::Mul(wy, dy), d, lit.block_w + p);
            const V px = hn::Load(d, state.place_x + p), py = hn::Load(d, state.place_y + p);
            hn::Store(hn::MulAdd(ux, px, hn::Mul(uy, py)), d, lit.place_u + p);
            hn::Store(hn::Mul(wy, py), d, lit.place_w + p);
        }
        const bool loose = (batch.loose >> i & 1) != 0;
        batch.touched[i] = uint16_t(loose ? 0xffffu : touchedBlocks(d, lit, f, i));
    }
    std::fill(batch.touched + count, batch.touched + kBatch, uint16_t(0));
    const hn::CappedTag<uint16_t, 32> d16;
    for (uint32_t block = 0; block < kBlockPixels; ++block) {
        batch.blocks[block] = 0;
        for (uint32_t i = 0; i < kBatch; i += uint32_t(hn::Lanes(d16))) {
            uint8_t bits[8] = {};
            hn::StoreMaskBits(d16, hn::TestBit(hn::Load(d16, batch.touched + i), hn::Set(d16, uint16_t(1u << block))),
                              bits);
            uint32_t word;
            std::memcpy(&word, bits, sizeof(word));
            batch.blocks[block] |= SplatList(word) << i;
        }
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
