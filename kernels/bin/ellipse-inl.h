// SPDX-License-Identifier: Apache-2.0
// Finds which of up to 4 x 4 square cells the ellipse of a splat touches; the ellipse is where power >= -cutoff.
// Included once for each SIMD target.

#if defined(GSC_KERNELS_ELLIPSE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_ELLIPSE_INL_H
#undef GSC_KERNELS_ELLIPSE_INL_H
#else
#define GSC_KERNELS_ELLIPSE_INL_H
#endif

#include <hwy/cache_control.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/project/project.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

constexpr uint32_t kCellsPerSide = 4;
constexpr uint32_t kCells = kCellsPerSide * kCellsPerSide;

HWY_INLINE void prefetchSplat(const Splat* splat)
{
    hwy::Prefetch(splat);
    hwy::Prefetch(&splat->y1); // the end of the splat may lie in the next cache line
}

// Quadratic form a dx^2 + b2 dx dy + c dy^2 of a splat, and its largest value at which the splat is drawn.
struct Ellipse {
    float x, y, a, b2, c, slope_x, slope_y, level;
    bool loose; // true: the form is not trusted, the splat may be drawn in any cell
};

HWY_INLINE Ellipse ellipseOf(const Splat& s)
{
    return {s.x,
            s.y,
            s.conic[0],
            2 * s.conic[1],
            s.conic[2],
            -s.conic[1] / s.conic[0],
            -s.conic[1] / s.conic[2],
            2 * s.cutoff,
            s.cutoff >= kLooseCutoff};
}

// Returns a bit for each of `cells` cells, a multiple of the lanes of d, that is set if the smallest value of the
// splat's quadratic form on the cell is at most 2 cutoff. Cell i has its first pixel at (cell_x[i], cell_y[i]) + (x, y)
// and its last `side` further. The smallest value of a positive definite form lies on one of the two sides nearest to
// the centre. No touched cell is missed: the cutoff allows for twice the rounding of the form.
template <class Tag, class V = hn::Vec<Tag>>
HWY_INLINE uint32_t touchedCells(Tag d, uint32_t cells, const Ellipse& splat, const float* cell_x, const float* cell_y,
                                 float x, float y, float side)
{
    if (splat.loose)
        return (1u << cells) - 1;
    const V a = hn::Set(d, splat.a), b2 = hn::Set(d, splat.b2), c = hn::Set(d, splat.c);
    const V slope_y = hn::Set(d, splat.slope_y), slope_x = hn::Set(d, splat.slope_x);
    const V zero = hn::Zero(d), extent = hn::Set(d, side), level = hn::Set(d, splat.level);
    // note: each difference is rounded once, since pixel coordinates in cells are small integers
    const V shift_x = hn::Set(d, x - splat.x), shift_y = hn::Set(d, y - splat.y);
    uint32_t touched = 0;
    for (uint32_t i = 0; i < cells; i += uint32_t(hn::Lanes(d))) {
        const V left = hn::Add(hn::Load(d, cell_x + i), shift_x), right = hn::Add(left, extent);
        const V top = hn::Add(hn::Load(d, cell_y + i), shift_y), bottom = hn::Add(top, extent);
        const V near_x = hn::Min(hn::Max(zero, left), right), near_y = hn::Min(hn::Max(zero, top), bottom);
        const V along_y = hn::Min(hn::Max(hn::Mul(slope_y, near_x), top), bottom);
        const V along_x = hn::Min(hn::Max(hn::Mul(slope_x, near_y), left), right);
        const auto form = [&](V u, V v) {
            return hn::MulAdd(hn::MulAdd(b2, v, hn::Mul(a, u)), u, hn::Mul(hn::Mul(c, v), v));
        };
        const V smallest = hn::Min(form(near_x, along_y), form(along_x, near_y));
        touched |= maskBits(d, hn::Le(smallest, level)) << i;
    }
    return touched;
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
