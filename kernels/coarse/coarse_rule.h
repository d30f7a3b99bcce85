// SPDX-License-Identifier: Apache-2.0
// Rules of FrameOptions::detail for a group of anchors, for both CPU and GPU (README.md): how large the group's cells
// are, whether it is far, and when its coarse copy is due to be made anew.
#pragma once

#include "kernels/math/eye.h"
#include "kernels/math/foveation.h"
#include "kernels/math/projection.h"
#include "kernels/math/real.h"

#include <cmath>

namespace gsc {

constexpr float kFarShare = 0.9f;       // a group is far if at least this share of its Gaussians is small
constexpr float kMostDirection = 0.03f; // change of the unit view direction after which a full copy is due
constexpr float kFullCopy = 0.3f;       // a copy is full if it has at least this share of its sources' Gaussians
constexpr float kMostLasting = 8.0f;    // largest factor by which kMostDirection grows for a copy that is not full
constexpr float kMostCloser = 0.3f;     // a copy is due when the camera is this many octaves of distance closer
constexpr float kMostFurther = 0.75f;   // a copy is due when the camera is this many octaves of distance farther
constexpr float kMostCloserOfLevels = 0.08f, kMostFurtherOfLevels = 0.15f; // octaves, closer or farther, with levels
constexpr float kMostLevels = 0.1f; // change of FrameOptions::lod_bias, in levels, after which a copy is due
// foveation, where the gaze arrives: a copy is due when cells are this many octaves too large
constexpr float kMostFine = 0.5f;
// foveation, where the gaze has left: a copy is due when cells are this many octaves too small
constexpr float kMostGross = 1.5f;
constexpr float kStaleMost = 2.0f;       // a copy is not drawn if its change is more than this many times its bound
constexpr float kNearAgain = 1.2f;       // a near group is tested again when its cells are larger by this factor
constexpr float kLargestOpacity = 0.99f; // largest opacity that blending uses

enum class CoarseKind : uint32_t { Unknown = 0, Far = 1, Near = 2 };

// Viewpoint for which a frame makes copies, and the sizes of cells that it wants.
struct CoarseView {
    float center[3];       // middle between the eyes, world units
    float pixel_at_one;    // width in world units of a pixel of the finer eye at distance 1, in the middle of its image
    float cell_at_one;     // edge of a cell at distance 1, world units: detail times pixel_at_one
    float half_distance;   // half the distance between the eyes, world units
    float lod_bias;        // FrameOptions::lod_bias, in levels
    float level_center[3]; // viewpoint from which levels are chosen, world units (LodLag)
    float most_closer, most_further; // kMostCloser and kMostFurther, or those of a model with levels
    float coarsest;   // square of the factor by which cells are larger where no eye looks; 1 or less: no foveation
    float gaze[2][3]; // unit vectors in the world, one for each eye; with one eye both are equal
};

// Size of the cells of a group.
struct CoarseCell {
    float edge;   // edge in world units, not yet rounded to a power of two
    float pixels; // edge in pixels at the group's nearest Gaussian: `detail`, or more with foveation
};

// View for which a group's copy was made, or for which the group was found to be near.
struct CoarseKey {
    float center[3]; // viewpoint: middle between the eyes, world units
    CoarseCell cell;
    float lod_bias; // FrameOptions::lod_bias of the view, in levels
};

GSC_HD CoarseKey keyOf(const CoarseView& view, const CoarseCell& cell)
{
    return {{view.center[0], view.center[1], view.center[2]}, cell, view.lod_bias};
}

// Viewpoint and sizes of cells for the copies of a frame. levels: the model has levels of detail. Precondition:
// eye_count is 1 or 2, detail is above 0.
inline CoarseView coarseView(const EyeParams* eyes, const EyeParams* level_eyes, uint32_t eye_count, float detail,
                             float lod_bias, bool levels)
{
    CoarseView view{};
    float square = 0, focal = 0;
    for (int i = 0; i < 3; ++i) {
        const float a = eyes[0].center[i], b = eyes[eye_count - 1].center[i];
        view.center[i] = 0.5f * (a + b);
        view.level_center[i] = 0.5f * (level_eyes[0].center[i] + level_eyes[eye_count - 1].center[i]);
        square += (a - b) * (a - b);
    }
    for (uint32_t e = 0; e < eye_count; ++e)
        focal = std::fmax(focal, std::fmax(eyes[e].focal_x, eyes[e].focal_y));
    view.pixel_at_one = 1.0f / focal;
    view.cell_at_one = detail / focal;
    view.half_distance = 0.5f * std::sqrt(square);
    view.lod_bias = lod_bias;
    view.most_closer = levels ? kMostCloserOfLevels : kMostCloser;
    view.most_further = levels ? kMostFurtherOfLevels : kMostFurther;
    for (auto& gaze : view.gaze)
        gaze[2] = 1;
    return view;
}

// Adds foveation to `view`. gaze: unit vectors in the spaces of the eyes; finest: variance, in pixels^2, of the
// smallest Gaussian worth drawing where no eye looks. An evenly filled cell has a variance of edge^2 / 12.
inline void foveate(const EyeParams* eyes, uint32_t eye_count, const float (*gaze)[3], float finest, CoarseView& view)
{
    const float detail = view.cell_at_one / view.pixel_at_one;
    view.coarsest = 12.0f * finest / (detail * detail);
    for (uint32_t e = 0; e < 2; ++e) {
        const uint32_t eye = e < eye_count ? e : 0;
        const float* const w = eyes[eye].world_to_view;
        for (int i = 0; i < 3; ++i)
            view.gaze[e][i] = w[i] * gaze[eye][0] + w[4 + i] * gaze[eye][1] + w[8 + i] * gaze[eye][2];
    }
}

// Distance from `center` to a box, 0 inside the box.
GSC_HD float boxDistance(const float* box_min, const float* box_max, const float* center)
{
    float square = 0;
    for (int i = 0; i < 3; ++i) {
        const float outside = maxNumber(maxNumber(box_min[i] - center[i], center[i] - box_max[i]), 0.0f);
        square += outside * outside;
    }
    return std::sqrt(square);
}

// Factor by which the cells of a group are larger than `detail`: as large as an eye does not notice (foveation.h) at
// the point of the group nearest to the gaze. 1 without foveation.
GSC_HD float cellGrowth(const CoarseView& view, const float* box_min, const float* box_max)
{
    if (view.coarsest <= 1)
        return 1;
    float along[2] = {}, square = 0, radius = 0;
    for (int i = 0; i < 3; ++i) {
        const float off = 0.5f * (box_min[i] + box_max[i]) - view.center[i], half = 0.5f * (box_max[i] - box_min[i]);
        square += off * off;
        radius += half * half;
        for (int e = 0; e < 2; ++e)
            along[e] += off * view.gaze[e][i];
    }
    if (radius >= square)
        return 1;
    const float cosine = minNumber(maxNumber(along[0], along[1]) / std::sqrt(square), 1.0f);
    // ring: squared sine of the angle that the box covers
    const float sine = std::sqrt(maxNumber(1 - cosine * cosine, 0.0f)), ring = radius / square;
    const float cosine_ring = std::sqrt(1 - ring);
    const float nearest = cosine >= cosine_ring ? 1 : cosine * cosine_ring + sine * std::sqrt(ring);
    return std::sqrt(maxNumber(finestVariance(nearest, view.coarsest), 1.0f));
}

// Size of a group's cells, wanted at the nearest Gaussian of the group.
GSC_HD CoarseCell wantedCell(const CoarseView& view, const float* box_min, const float* box_max)
{
    const float growth = cellGrowth(view, box_min, box_max);
    return {view.cell_at_one * boxDistance(box_min, box_max, view.center) * growth,
            view.cell_at_one / view.pixel_at_one * growth};
}

// Exponent of the largest power of two that is not above `cell`. Precondition: `cell` is above 0 and finite.
GSC_HD int cellExponent(float cell)
{
    return int(__builtin_bit_cast(uint32_t, cell) >> 23 & 255u) - 127;
}

// Returns true if the eye surely sees every anchor of a group. A copy shows the whole group, which would be too much of
// a group that is seen in part.
GSC_HD bool seesAll(const EyeParams& eye, float near_z, const GroupRecord& group)
{
    const Vec3<float> c{0.5f * (group.anchor_min[0] + group.anchor_max[0]),
                        0.5f * (group.anchor_min[1] + group.anchor_max[1]),
                        0.5f * (group.anchor_min[2] + group.anchor_max[2])};
    const float hx = group.anchor_max[0] - c.x, hy = group.anchor_max[1] - c.y, hz = group.anchor_max[2] - c.z;
    const float size = std::fabs(c.x) + std::fabs(c.y) + std::fabs(c.z) + std::fabs(eye.center[0]) +
                       std::fabs(eye.center[1]) + std::fabs(eye.center[2]);
    const float radius = std::sqrt(hx * hx + hy * hy + hz * hz) * 1.001f + size * 4e-6f;
    const Vec3<float> t = viewPoint<float>(eye, c);
    const auto inside = [&](float along, float focal, float middle, float pixels) {
        // half: half the image less a pixel; off: distance of its middle from the optical axis; both in pixels
        const float half = 0.5f * pixels - 1.0f, off = focal * middle;
        const float normal = std::sqrt(focal * focal + (half + std::fabs(off)) * (half + std::fabs(off)));
        return std::fabs(along * focal - t.z * off) + radius * normal <= t.z * half;
    };
    return t.z - radius > near_z && inside(t.x, eye.focal_x, eye.tan_mid_x, float(eye.width)) &&
           inside(t.y, eye.focal_y, eye.tan_mid_y, float(eye.height));
}

// Change of the view direction after which a copy is due; the copy has `count` Gaussians, made of `source`. A copy of
// fewer Gaussians is more blurred, so that it may turn more before one sees that.
GSC_HD float mostDirection(uint32_t count, uint32_t source)
{
    const float lasts = kFullCopy * float(source) / maxNumber(float(count), 1.0f);
    return kMostDirection * minNumber(maxNumber(lasts, 1.0f), kMostLasting);
}

// Change of the view since a copy was made: the largest of several changes, each divided by its bound; above 1 the copy
// is due. cell: wantedCell() for the present view. A copy whose cells are finer, or whose levels are more, than wanted
// may be drawn longer (kStaleMost): nothing is missing in it.
GSC_HD float coarseChange(const CoarseView& view, const CoarseKey& key, const CoarseCell& cell, const float* box_min,
                          const float* box_max, float most_direction = kMostDirection)
{
    float now[3], then[3], a = 0, b = 0, turned = 0;
    for (int i = 0; i < 3; ++i) {
        const float middle = 0.5f * (box_min[i] + box_max[i]);
        now[i] = middle - view.center[i];
        then[i] = middle - key.center[i];
        a += now[i] * now[i];
        b += then[i] * then[i];
    }
    const float inverse_a = 1.0f / std::sqrt(a), inverse_b = 1.0f / std::sqrt(b);
    for (int i = 0; i < 3; ++i) {
        const float change = now[i] * inverse_a - then[i] * inverse_b;
        turned += change * change;
    }
    // adds view.half_distance, since each eye is that far from the middle
    const float direction = (std::sqrt(turned) + view.half_distance * inverse_a) / most_direction;
    const float grown = view.coarsest > 1 ? std::log2(cell.pixels) - std::log2(key.cell.pixels) : 0;
    const float octaves = std::log2(cell.edge) - std::log2(key.cell.edge) - grown; // change of distance in octaves
    const auto of = [](float change, float less, float more) {
        return change < 0 ? -change / less : minNumber(change / more, kStaleMost);
    };
    const float size = maxNumber(of(octaves, view.most_closer, view.most_further), of(grown, kMostFine, kMostGross));
    const float more = (view.lod_bias - key.lod_bias) * (1.0f / kMostLevels);
    const float levels = more < 0 ? minNumber(-more, kStaleMost) : more;
    const float change = maxNumber(maxNumber(direction, size), levels);
    return change < 1e6f ? change : 1e6f; // true also for NaN, where the view lies in the box or in its middle
}

// Decision of a frame about a group that it sees.
struct CoarseLook {
    CoarseCell cell;
    float change; // change since the group's copy was made, 1 = due; infinite without a copy
    bool draws;   // true if the copy may be drawn as it is
    bool due;     // true if a copy should be made, or made anew
};

// Decides about a group. shows_all: the eyes see all of the group. Kept: type of the group's state, with members key,
// kind, count and source.
template <typename Kept>
GSC_HD CoarseLook coarseLook(const CoarseView& view, const GroupRecord& record, const Kept& kept, bool shows_all)
{
    const CoarseCell cell = wantedCell(view, record.gaussian_min, record.gaussian_max);
    const CoarseKind kind = CoarseKind(kept.kind);
    const auto change = [&](const CoarseKey& key, float most_direction = kMostDirection) {
        return coarseChange(view, key, cell, record.gaussian_min, record.gaussian_max, most_direction);
    };
    const float most = mostDirection(kept.count, kept.source);
    CoarseLook look{cell, kind == CoarseKind::Far ? change(kept.key, most) : INFINITY, false, false};
    look.draws = shows_all && look.change <= kStaleMost;
    const bool can_be_far =
        shows_all && cell.edge > 0 && change(keyOf(view, cell)) <= 1; // true if a copy made now would meet every bound
    look.due = can_be_far && (kind == CoarseKind::Near ? cell.edge > kNearAgain * kept.key.cell.edge : look.change > 1);
    return look;
}

// Area of a Gaussian on the screen in pixels squared, with the rasteriser's blur. The Gaussian, of covariance C in
// world units, is seen along the unit vector `direction`, and a world unit spans `scale` pixels. trace: that of C;
// along: direction C direction; adjugate: direction adj(C) direction.
GSC_HD float screenArea(float trace, float along, float adjugate, float scale)
{
    const float s = scale * scale, filter = 0.3f;
    const float det = s * s * adjugate + filter * s * (trace - along) + filter * filter;
    return std::sqrt(maxNumber(det, filter * filter));
}

// Optical depth that is added where Gaussians are joined. Their light is added up: optical depth times area on the
// screen. Blending draws nothing below an opacity of 1/255, so of a depth just above that little is drawn.
constexpr float kUndrawnDepth = 1.0f / 255.0f;

GSC_HD float opticalDepth(float opacity)
{
    return -std::log(1.0f - minNumber(opacity, kLargestOpacity));
}

// Cover: factor by which a joined Gaussian's area grows if the optical depth in its middle is more than blending uses.
// A profile 1 - exp(-depth g) covers Ein(depth) times the area of g, and Ein(depth) is 0.5772 + log(depth) for depths
// above 4.
constexpr float kEuler = 0.577216f;
// optical depth at kLargestOpacity, and cover at that depth
constexpr float kMostDepth = 4.605170f, kMostCover = kEuler + 1.527180f;

GSC_HD float widening(float depth)
{
    return depth > kMostDepth ? (kEuler + std::log(depth)) * (1.0f / kMostCover) : 1.0f;
}

// Factor by which a covariance must be multiplied for its Gaussian to cover `wanted` pixels squared on the screen
// (screenArea()). `wanted` is at least what it covers now. Very large if the covariance covers nothing.
GSC_HD float growth(float trace, float along, float adjugate, float scale, float wanted)
{
    const float s = scale * scale, filter = 0.3f;
    const float linear = filter * s * (trace - along), more = wanted * wanted - filter * filter;
    return 2.0f * more / (linear + std::sqrt(linear * linear + 4.0f * s * s * adjugate * more));
}
constexpr float kMostGrowth = 20.0f; // beyond this factor a covariance is taken to cover nothing

} // namespace gsc
