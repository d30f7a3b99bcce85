// SPDX-License-Identifier: Apache-2.0
// Makes coarse copies on a CPU. A vector's lanes are first Gaussians, then cells. The Gaussians of a cell are added in
// the order in which they were decoded.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/coarse/coarse_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/coarse/coarse_cpu.h"
#include "kernels/project/covariance-inl.h"
#include "kernels/simd/simd_math-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

using M = hn::Mask<D>;

// Sums of a cell: light; light times place in the cell (3 sums); light times colour (3); light times second moments of
// the place (6: xx xy xz yy yz zz).
enum CellSum : uint32_t { kLight = 0, kPlace = 1, kTint = 4, kMoment = 7, kSums = 13 };
constexpr uint32_t kAxisBits = 10, kAxisCells = 1u << kAxisBits; // largest number of cells of a group along an axis
constexpr uint32_t kNoCell = ~0u;

// log(x) of positive normal numbers, with an absolute error of 3e-7 near 1.
HWY_INLINE V fineLog(D d, V x)
{
    const hn::RebindToSigned<D> di;
    const V one = hn::Set(d, 1.0f);
    // splits x into m 2^e, with m in [2/3, 4/3)
    const auto bits = hn::BitCast(di, x);
    const auto exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, 0x3f2aaaab)));
    const V m = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(exponent)));
    const V s = hn::Div(hn::Sub(m, one), hn::Add(m, one)), s2 = hn::Mul(s, s);
    V p = hn::MulAdd(hn::Set(d, 1.0f / 9), s2, hn::Set(d, 1.0f / 7));
    p = hn::MulAdd(p, s2, hn::Set(d, 1.0f / 5));
    p = hn::MulAdd(p, s2, hn::Set(d, 1.0f / 3));
    p = hn::MulAdd(hn::Mul(p, s2), s, s);
    return hn::MulAdd(hn::ConvertTo(d, exponent), hn::Set(d, 0.69314718f), hn::Add(p, p));
}

// opticalDepth() for the lanes of a vector.
HWY_INLINE V depthLanes(D d, V opacity)
{
    return hn::Neg(fineLog(d, hn::Sub(hn::Set(d, 1.0f), hn::Min(opacity, hn::Set(d, kLargestOpacity)))));
}

// Arguments of screenArea() for the lanes of a vector, one Gaussian each.
struct SeenLanes {
    V trace, along, adjugate, scale;
};

HWY_INLINE SeenLanes seenLanes(D d, const CoarseView& view, const V* position, const V* c)
{
    V u[3];
    for (int i = 0; i < 3; ++i)
        u[i] = hn::Sub(position[i], hn::Set(d, view.center[i]));
    const V square = dot3(u[0], u[1], u[2], u[0], u[1], u[2]);
    const V inverse = reciprocalSqrt(d, hn::Max(square, hn::Set(d, 1e-30f)));
    for (V& v : u)
        v = hn::Mul(v, inverse);
    const V two = hn::Set(d, 2.0f);
    const auto form = [&](V xx, V xy, V xz, V yy, V yz, V zz) { // quadratic form u C u of the unit view direction
        const V mixed = dot3(xy, xz, yz, hn::Mul(u[0], u[1]), hn::Mul(u[0], u[2]), hn::Mul(u[1], u[2]));
        const V own = dot3(xx, yy, zz, hn::Mul(u[0], u[0]), hn::Mul(u[1], u[1]), hn::Mul(u[2], u[2]));
        return hn::MulAdd(two, mixed, own);
    };
    const auto minor = [](V a, V b, V p, V q) { return hn::NegMulAdd(p, q, hn::Mul(a, b)); };
    SeenLanes seen;
    seen.trace = hn::Add(hn::Add(c[0], c[3]), c[5]);
    seen.along = form(c[0], c[1], c[2], c[3], c[4], c[5]);
    const V adjugate =
        form(minor(c[3], c[5], c[4], c[4]), minor(c[2], c[4], c[1], c[5]), minor(c[1], c[4], c[2], c[3]),
             minor(c[0], c[5], c[2], c[2]), minor(c[1], c[2], c[0], c[4]), minor(c[0], c[3], c[1], c[1]));
    seen.adjugate = hn::Max(adjugate, hn::Zero(d));
    seen.scale = hn::Mul(inverse, hn::Set(d, 1.0f / view.pixel_at_one));
    return seen;
}

constexpr float kFilter = 0.3f; // variance of the rasteriser's blur, pixels squared

// screenArea() for the lanes of a vector.
HWY_INLINE V areaLanes(D d, const SeenLanes& seen)
{
    const V s = hn::Mul(seen.scale, seen.scale);
    const V linear = hn::Mul(hn::Set(d, kFilter), hn::Sub(seen.trace, seen.along));
    const V det = hn::MulAdd(s, hn::MulAdd(s, seen.adjugate, linear), hn::Set(d, kFilter * kFilter));
    return hn::Sqrt(hn::Max(det, hn::Set(d, kFilter * kFilter)));
}

// growth() for the lanes of a vector.
HWY_INLINE V growthLanes(D d, const SeenLanes& seen, V wanted)
{
    const V s = hn::Mul(seen.scale, seen.scale);
    const V linear = hn::Mul(hn::Mul(hn::Set(d, kFilter), s), hn::Sub(seen.trace, seen.along));
    const V more = hn::MulSub(wanted, wanted, hn::Set(d, kFilter * kFilter));
    const V four = hn::Mul(hn::Mul(hn::Set(d, 4.0f), hn::Mul(s, s)), hn::Mul(seen.adjugate, more));
    const V root = hn::Sqrt(hn::Max(hn::MulAdd(linear, linear, four), hn::Zero(d)));
    return hn::Div(hn::Add(more, more), hn::Add(linear, root));
}

// State of a group while its copy is made.
struct Joining {
    const CoarseView& view;
    const GaussianBlock& g;
    const JoinOrigins& origins;
    JoinScratch& scratch;
    float edge, per_cell, base[3]; // edge of a cell, world units; cells per world unit; corner of the first cell
    uint32_t places, cells;

    HWY_INLINE void load(D d, size_t at, V* position, V* covariance) const
    {
        const auto get = [&](const float* p) { return hn::LoadU(d, p + at); };
        const V scale[3] = {get(g.scale[0]), get(g.scale[1]), get(g.scale[2])};
        const V q[4] = {get(g.rotation[0]), get(g.rotation[1]), get(g.rotation[2]), get(g.rotation[3])};
        worldCovariance(d, scale, q, covariance);
        for (int i = 0; i < 3; ++i)
            position[i] = get(g.position[i]);
    }
};

// Lanes whose Gaussians are small enough to be joined; Gaussians with values that are not finite never are.
HWY_INLINE M isSmall(D d, const Joining& group, size_t at)
{
    const GaussianBlock& g = group.g;
    const auto load = [&](const float* p) { return hn::LoadU(d, p + at); };
    V sum = hn::Zero(d);
    for (int i = 0; i < 3; ++i)
        sum = hn::Add(sum, hn::Add(load(g.position[i]), hn::Add(load(g.color[i]), load(g.scale[i]))));
    for (int i = 0; i < 4; ++i)
        sum = hn::Add(sum, load(g.rotation[i]));
    const V largest = hn::Max(load(g.scale[0]), hn::Max(load(g.scale[1]), load(g.scale[2])));
    return hn::And(hn::Lt(largest, hn::Set(d, group.edge)), hn::Eq(hn::Sub(sum, sum), hn::Zero(d)));
}

// Returns the index of the cell with this key, which is made if there is none.
HWY_INLINE uint32_t cellOf(Joining& group, uint32_t key, uint64_t order)
{
    JoinScratch& scratch = group.scratch;
    uint32_t at = (key * 2654435769u) >> (32 - std::countr_zero(group.places));
    while (scratch.table[at] != kNoCell) {
        const uint32_t cell = scratch.table[at];
        if (scratch.keys[cell] == key) {
            scratch.order[cell].order = std::min(scratch.order[cell].order, order);
            return cell;
        }
        at = (at + 1) & (group.places - 1);
    }
    const uint32_t cell = group.cells++;
    scratch.table[at] = cell;
    scratch.keys[cell] = key;
    scratch.order[cell] = {order, cell};
    std::fill_n(scratch.cells.data() + size_t(cell) * kCellRow, kCellRow, 0.0f);
    return cell;
}

// Adds the small Gaussians of a vector to their cells.
HWY_INLINE void gatherVector(D d, Joining& group, size_t at, M small)
{
    const hn::RebindToSigned<D> di;
    V position[3], c[6];
    group.load(d, at, position, c);
    const V depth = depthLanes(d, hn::LoadU(d, group.g.opacity + at));
    const V area = areaLanes(d, seenLanes(d, group.view, position, c));
    const V light = hn::Mul(hn::Max(hn::Sub(depth, hn::Set(d, kUndrawnDepth)), hn::Set(d, 1e-7f)), area);
    HWY_ALIGN float value[kSums][kMaxLanes];
    HWY_ALIGN int32_t keys[kMaxLanes];
    auto key = hn::Zero(di);
    V place[3];
    for (int i = 0; i < 3; ++i) {
        const V in = hn::MulSub(position[i], hn::Set(d, group.per_cell), hn::Set(d, group.base[i]));
        const V index = hn::Min(hn::Max(hn::Floor(in), hn::Zero(d)), hn::Set(d, float(kAxisCells - 1)));
        place[i] = hn::Min(hn::Max(hn::Sub(in, index), hn::Zero(d)), hn::Set(d, 1.0f));
        key = hn::Or(key, hn::ShiftLeftSame(hn::ConvertTo(di, index), int(kAxisBits) * i));
    }
    hn::Store(key, di, keys);
    hn::Store(light, d, value[kLight]);
    const V unit = hn::Set(d, group.per_cell * group.per_cell);
    uint32_t moment = 0;
    for (uint32_t i = 0; i < 3; ++i) {
        const V weighted = hn::Mul(light, place[i]);
        hn::Store(weighted, d, value[kPlace + i]);
        hn::Store(hn::Mul(light, hn::LoadU(d, group.g.color[i] + at)), d, value[kTint + i]);
        for (uint32_t j = i; j < 3; ++j, ++moment)
            hn::Store(hn::MulAdd(weighted, place[j], hn::Mul(light, hn::Mul(c[moment], unit))), d,
                      value[kMoment + moment]);
    }
    for (uint32_t bits = maskBits(small); bits != 0; bits &= bits - 1) {
        const auto lane = uint32_t(std::countr_zero(bits));
        const uint32_t cell = cellOf(group, uint32_t(keys[lane]), group.origins.order(group.g.origin[at + lane]));
        float* const sums = group.scratch.cells.data() + size_t(cell) * kCellRow;
        for (uint32_t s = 0; s < kSums; ++s)
            sums[s] += value[s][lane];
    }
}

// Makes a vector of cells, from `first` on, one Gaussian each, and appends them to the copy's tiles.
HWY_INLINE void joinCells(D d, const Joining& group, size_t first)
{
    const hn::RebindToSigned<D> di;
    const JoinScratch& scratch = group.scratch;
    const float* const cells = scratch.cells.data() + first * kCellRow;
    const auto lanes = hn::Mul(hn::Iota(di, 0), hn::Set(di, int32_t(kCellRow)));
    const auto sum = [&](uint32_t which) { return hn::GatherIndex(d, cells + which, lanes); };
    float* const tile = group.scratch.tiles.data() + first / kMaxLanes * kTileValues + first % kMaxLanes;
    const auto put = [&](V v, uint32_t row) { hn::StoreU(v, d, tile + row * kMaxLanes); };
    const V light = sum(kLight), inverse = hn::Div(hn::Set(d, 1.0f), light), edge = hn::Set(d, group.edge);
    const auto key = hn::LoadU(di, reinterpret_cast<const int32_t*>(scratch.keys.data()) + first);
    V mean[3], position[3], c[6];
    for (uint32_t i = 0; i < 3; ++i) {
        mean[i] = hn::Mul(sum(kPlace + i), inverse);
        const auto axis = hn::And(hn::ShiftRightSame(key, int(kAxisBits * i)), hn::Set(di, int32_t(kAxisCells - 1)));
        const V index = hn::Add(hn::Set(d, group.base[i]), hn::ConvertTo(d, axis));
        position[i] = hn::Mul(hn::Add(index, mean[i]), edge);
        put(position[i], kTilePosition + i);
        put(hn::Min(hn::Mul(sum(kTint + i), inverse), hn::Set(d, 1.0f)), kTileColor + i);
    }
    const V square = hn::Mul(edge, edge);
    uint32_t at = 0;
    for (uint32_t i = 0; i < 3; ++i)
        for (uint32_t j = i; j < 3; ++j, ++at) {
            c[at] = hn::NegMulAdd(mean[i], mean[j], hn::Mul(sum(kMoment + at), inverse));
            c[at] = hn::Mul(i == j ? hn::Max(c[at], hn::Set(d, 1e-6f)) : c[at], square);
        }
    const SeenLanes seen = seenLanes(d, group.view, position, c);
    const V area = areaLanes(d, seen);
    const V depth = hn::Add(hn::Div(light, area), hn::Set(d, kUndrawnDepth));
    V factor = hn::Set(d, 1.0f);
    // widens dense Gaussians, by the rules of widening() and kMostGrowth in coarse_rule.h
    if (const M dense = hn::Gt(depth, hn::Set(d, kMostDepth)); !hn::AllFalse(d, dense)) {
        const V cover = hn::Add(hn::Set(d, kEuler), fineLog(d, depth));
        const V grows = growthLanes(d, seen, hn::Mul(area, hn::Mul(cover, hn::Set(d, 1.0f / kMostCover))));
        factor = hn::IfThenElse(hn::And(dense, hn::Lt(grows, hn::Set(d, kMostGrowth))), grows, factor);
    }
    for (uint32_t i = 0; i < 6; ++i)
        put(hn::Mul(c[i], factor), kTileCovariance + i);
    const V through = expAny(d, hn::Neg(depth));
    put(hn::Min(hn::Sub(hn::Set(d, 1.0f), through), hn::Set(d, kLargestOpacity)), kTileOpacity);
}

// Appends the Gaussians of a vector that are not joined, as they were decoded.
HWY_INLINE void keepVector(D d, const Joining& group, size_t at, uint32_t bits, uint32_t& count)
{
    HWY_ALIGN float rows[6][kMaxLanes];
    V position[3], c[6];
    group.load(d, at, position, c);
    for (int i = 0; i < 6; ++i)
        hn::Store(c[i], d, rows[i]);
    for (; bits != 0; bits &= bits - 1, ++count) {
        const auto lane = uint32_t(std::countr_zero(bits));
        float* const to = group.scratch.tiles.data() + count / kMaxLanes * kTileValues + count % kMaxLanes;
        for (uint32_t i = 0; i < 6; ++i)
            to[(kTileCovariance + i) * kMaxLanes] = rows[i][lane];
        for (uint32_t i = 0; i < 3; ++i) {
            to[(kTilePosition + i) * kMaxLanes] = group.g.position[i][at + lane];
            to[(kTileColor + i) * kMaxLanes] = group.g.color[i][at + lane];
        }
        to[kTileOpacity * kMaxLanes] = group.g.opacity[at + lane];
        group.scratch.order[count] = {group.origins.order(group.g.origin[at + lane]), count};
    }
}

uint32_t joinGroup(const CoarseView& view, const GroupRecord& record, float edge, const GaussianBlock& g,
                   const JoinOrigins& origins, JoinScratch& scratch, bool& far)
{
    const D d;
    const size_t lanes = hn::Lanes(d);
    Joining group{view, g, origins, scratch, edge, 1.0f / edge, {}, tablePlaces(g.count), 0};
    bool fits = true;
    for (int i = 0; i < 3; ++i) {
        group.base[i] = std::floor(record.gaussian_min[i] / edge);
        fits = fits && record.gaussian_max[i] / edge - group.base[i] < float(kAxisCells - 1);
    }
    const auto small = [&](size_t at) { return hn::And(isSmall(d, group, at), hn::FirstN(d, g.count - at)); };
    size_t joins = 0;
    for (size_t at = 0; at < g.count; at += lanes)
        joins += hn::CountTrue(d, small(at));
    far = fits && float(joins) >= kFarShare * float(g.count);
    if (!far)
        return 0;
    std::fill_n(scratch.table.data(), group.places, kNoCell);
    for (size_t at = 0; at < g.count; at += lanes)
        if (const M mask = small(at); !hn::AllFalse(d, mask))
            gatherVector(d, group, at, mask);
    uint32_t count = group.cells;
    // cells that fill up the last vector get finite values
    std::fill_n(scratch.cells.data() + size_t(count) * kCellRow, size_t(kMaxLanes) * kCellRow, 1.0f);
    std::fill_n(scratch.keys.data() + count, kMaxLanes, 0u);
    for (size_t first = 0; first < count; first += lanes)
        joinCells(d, group, first);
    for (size_t at = 0; at < g.count; at += lanes) {
        const size_t left = g.count - at;
        const uint32_t all = left >= lanes ? (1u << lanes) - 1 : (1u << left) - 1;
        if (const uint32_t large = all & ~maskBits(small(at)); large != 0)
            keepVector(d, group, at, large, count);
    }
    return count;
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(joinGroup);

void reserveJoin(uint32_t n_offsets, JoinScratch& scratch)
{
    const uint32_t gaussians = kGroupSize * n_offsets;
    const size_t cells = gaussians + kMaxLanes; // room for one vector more: the last one may end behind the last cell
    scratch.cells.reserve(cells * kCellRow);
    scratch.table.reserve(tablePlaces(gaussians));
    scratch.keys.reserve(cells);
    scratch.order.reserve(cells);
    scratch.tiles.reserve((cells / kMaxLanes + 1) * kTileValues);
}

uint32_t joinGroupCpu(const CoarseView& view, const GroupRecord& record, float cell, const GaussianBlock& decoded,
                      const JoinOrigins& origins, JoinScratch& scratch, bool& far)
{
    const float edge = std::ldexp(1.0f, cellExponent(cell));
    const uint32_t count = HWY_DYNAMIC_DISPATCH(joinGroup)(view, record, edge, decoded, origins, scratch, far);
    std::sort(scratch.order.data(), scratch.order.data() + count,
              [](const OrderedGaussian& a, const OrderedGaussian& b) { return a.order < b.order; });
    return count;
}

void storeCopy(const JoinScratch& scratch, uint32_t count, float* tiles)
{
    const auto place = [](uint32_t i) { return i / kMaxLanes * kTileValues + i % kMaxLanes; };
    for (uint32_t i = 0; i < count || i % kMaxLanes != 0; ++i) {
        const float* const from = scratch.tiles.data() + place(scratch.order[std::min(i, count - 1)].at);
        for (uint32_t row = 0; row < kTileRows; ++row)
            tiles[place(i) + row * kMaxLanes] = from[row * kMaxLanes];
    }
}

} // namespace gsc
#endif
