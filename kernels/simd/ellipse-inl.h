// SPDX-License-Identifier: Apache-2.0
// Which of 4 x 4 square cells the ellipse power >= -cutoff of a splat touches. Included once per target.

#if defined(GSC_KERNELS_ELLIPSE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GSC_KERNELS_ELLIPSE_INL_H
#undef GSC_KERNELS_ELLIPSE_INL_H
#else
#define GSC_KERNELS_ELLIPSE_INL_H
#endif

#include "kernels/simd/simd_math-inl.h"
#include "kernels/project/project.h"

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

constexpr uint32_t kCellsPerSide = 4;
constexpr uint32_t kCells = kCellsPerSide * kCellsPerSide;

// Cell i has its first pixel at (cell_x[i], cell_y[i]) + (x, y) and its last `side` further. Bit i is set if the
// smallest value of the splat's quadratic form on the cell is at most 2 cutoff; for a positive definite form it lies
// on one of the two sides nearest the centre. Conservative: the cutoff allows for twice the rounding of the form.
HWY_INLINE uint32_t touchedCells(const Splat& splat, const float* cell_x, const float* cell_y, float x, float y,
                                 float side)
{
    if (splat.cutoff >= kLooseCutoff)
        return (1u << kCells) - 1;
    const D d;
    const V a = hn::Set(d, splat.conic[0]), b2 = hn::Set(d, 2 * splat.conic[1]), c = hn::Set(d, splat.conic[2]);
    const V slope_y = hn::Set(d, -splat.conic[1] / splat.conic[2]);
    const V slope_x = hn::Set(d, -splat.conic[1] / splat.conic[0]);
    const V zero = hn::Zero(d), extent = hn::Set(d, side), level = hn::Set(d, 2 * splat.cutoff);
    // note: one rounding each, since the cells' pixels are small integers
    const V shift_x = hn::Set(d, x - splat.x), shift_y = hn::Set(d, y - splat.y);
    uint32_t touched = 0;
    for (uint32_t i = 0; i < kCells; i += uint32_t(hn::Lanes(d))) {
        const V left = hn::Add(hn::Load(d, cell_x + i), shift_x), right = hn::Add(left, extent);
        const V top = hn::Add(hn::Load(d, cell_y + i), shift_y), bottom = hn::Add(top, extent);
        const V near_x = hn::Min(hn::Max(zero, left), right), near_y = hn::Min(hn::Max(zero, top), bottom);
        const V along_y = hn::Min(hn::Max(hn::Mul(slope_y, near_x), top), bottom);
        const V along_x = hn::Min(hn::Max(hn::Mul(slope_x, near_y), left), right);
        const auto form = [&](V u, V v) {
            return hn::MulAdd(hn::MulAdd(b2, v, hn::Mul(a, u)), u, hn::Mul(hn::Mul(c, v), v));
        };
        const V smallest = hn::Min(form(near_x, along_y), form(along_x, near_y));
        touched |= maskBits(hn::Le(smallest, level)) << i;
    }
    return touched;
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#endif
