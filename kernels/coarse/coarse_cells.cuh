// SPDX-License-Identifier: Apache-2.0
// Joins the small Gaussians of a group, in one block: adds up sums for each cell in shared memory, and makes each cell
// one Gaussian. The sums are whole numbers, so that the order of adding does not matter.
#pragma once

#include "kernels/coarse/coarse_gaussian.cuh"
#include "kernels/decode/fast/emit.cuh"

namespace gsc {

constexpr uint32_t kCells = 704;     // places in the table of cells; with all else they take 99 KiB of shared memory
constexpr uint32_t kMostCells = 640; // largest number of cells in a copy
constexpr uint32_t kAxisBits = 10, kAxisCells = 1u << kAxisBits; // largest number of cells of a group along an axis
constexpr uint32_t kNoKey = ~0u;
constexpr float kOne =
    float(1u << 21); // largest weight in the sums; a moment is at most twice that, so 512 of them fit 31 bits

// Sums of a cell, in steps of 1 / kOne: weight; weight times place in the cell (3 sums); weight times colour (3);
// weight times second moments of the place (6: xx xy xz yy yz zz).
enum CellSum : uint32_t { kWeight = 0, kPlace = 1, kColor = 4, kMoment = 7, kSums = 13 };

struct CellSums {
    uint32_t keys[kCells];   // key of the cell in each place of the table, kNoKey: none
    uint32_t orders[kCells]; // smallest emission order of the Gaussians joined in each cell
    int32_t sums[kSums][kCells];
    uint16_t places[kMostCells]; // places in the table of the cells that fit into the copy
    uint32_t count;              // number of cells that the group has
};

// Numbers of a group that the warps need while they make its copy.
struct MadeGroup {
    CoarseFrame frame;
    float base[3];  // lower corner of the group's first cell, world units
    float per_cell; // cells per world unit
    float most;     // reciprocal of the group's largest weight
};

// Place in the table of the cell `key`; takes a free place for a cell that has none yet; kCells if no place is left.
__device__ __forceinline__ uint32_t placeOfCell(CellSums& cells, uint32_t key)
{
    uint32_t at = __umulhi(key * 2654435769u, kCells);
    for (uint32_t tries = 0; tries < kCells; ++tries) {
        const uint32_t was = atomicCAS(&cells.keys[at], kNoKey, key);
        if (was == kNoKey)
            if (const uint32_t cell = atomicAdd(&cells.count, 1u); cell < kMostCells)
                cells.places[cell] = uint16_t(at);
        if (was == kNoKey || was == key)
            return at;
        at = at + 1 == kCells ? 0 : at + 1;
    }
    return kCells;
}

// A Gaussian, and how it looks from the viewpoint for which the copy is made.
struct Seen {
    float covariance[6];          // xx xy xz yy yz zz, world units squared
    float trace, along, adjugate; // arguments of screenArea()
    float scale;
};

__device__ __forceinline__ float distanceTo(const float* position, const float* center, float (&direction)[3])
{
    float square = 0.0f;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        direction[i] = position[i] - center[i];
        square = fmaf(direction[i], direction[i], square);
    }
    const float inverse = rsqrtf(fmaxf(square, 1e-30f));
#pragma unroll
    for (float& d : direction)
        d *= inverse;
    return square * inverse;
}

__device__ __forceinline__ Seen seen(const CoarseView& view, const float* position, const ActiveGaussian& active)
{
    Seen it{};
    float r[9], direction[3];
    rotationOf(active.quaternion, r);
    it.scale = __fdividef(1.0f, view.pixel_at_one * distanceTo(position, view.center, direction));
    float square[3];
#pragma unroll
    for (int k = 0; k < 3; ++k) {
        square[k] = active.sigma[k] * active.sigma[k];
        it.trace += square[k];
    }
#pragma unroll
    for (int k = 0; k < 3; ++k) {
        const float x = r[k], y = r[3 + k], z = r[6 + k];
        const float turned = x * direction[0] + y * direction[1] + z * direction[2];
        it.along = fmaf(square[k], turned * turned, it.along);
        it.adjugate = fmaf(square[(k + 1) % 3] * square[(k + 2) % 3], turned * turned, it.adjugate);
        const float products[6] = {x * x, x * y, x * z, y * y, y * z, z * z};
#pragma unroll
        for (int i = 0; i < 6; ++i)
            it.covariance[i] = fmaf(square[k], products[i], it.covariance[i]);
    }
    return it;
}

// Adds a small Gaussian to the sums of its cell.
__device__ __forceinline__ void join(CellSums& cells, const MadeGroup& group, const float* position, const Seen& it,
                                     const ActiveGaussian& active, float opacity, uint32_t order)
{
    uint32_t key = 0;
    float place[3];
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        const float at = position[i] * group.per_cell - group.base[i];
        const float index = fminf(fmaxf(floorf(at), 0.0f), float(kAxisCells - 1));
        place[i] = fminf(fmaxf(at - index, 0.0f), 1.0f);
        key |= uint32_t(index) << (kAxisBits * i);
    }
    const uint32_t cell = placeOfCell(cells, key);
    if (cell == kCells)
        return;
    const float light =
        (opticalDepth(opacity) - kUndrawnDepth) * screenArea(it.trace, it.along, it.adjugate, it.scale) * group.most;
    const float weight = fmaxf(fminf(light, 1.0f) * kOne, 1.0f);
    const auto add = [&](uint32_t which, float value) { atomicAdd(&cells.sums[which][cell], __float2int_rn(value)); };
    add(kWeight, weight);
    const float unit = group.per_cell * group.per_cell;
    uint32_t moment = kMoment;
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        add(kPlace + i, weight * place[i]);
        add(kColor + i, weight * active.color[i]);
#pragma unroll
        for (int j = i; j < 3; ++j, ++moment)
            add(moment, weight * fmaf(it.covariance[moment - kMoment], unit, place[i] * place[j]));
    }
    atomicMin(&cells.orders[cell], order);
}

// Makes the sums of a cell one Gaussian.
__device__ __forceinline__ CoarseGaussian joined(const CellSums& cells, const MadeGroup& group, const CoarseView& view,
                                                 uint32_t cell)
{
    const auto sum = [&](uint32_t which) { return float(cells.sums[which][cell]); };
    const float weight = sum(kWeight), inverse = __fdividef(1.0f, weight);
    CoarseGaussian out;
    float mean[3];
#pragma unroll
    for (int i = 0; i < 3; ++i) {
        mean[i] = sum(kPlace + i) * inverse;
        const float index = float(cells.keys[cell] >> (kAxisBits * i) & (kAxisCells - 1));
        out.position[i] = (group.base[i] + index + mean[i]) * group.frame.cell;
        out.color[i] = fminf(fmaxf(sum(kColor + i) * inverse, 0.0f), 1.0f);
    }
    // largest amount by which rounding may reduce a sum of squares: without it a faint Gaussian could get any shape
    const float rounding = 3.0f * inverse + 1e-6f;
    float c[6];
    uint32_t at = 0;
#pragma unroll
    for (int i = 0; i < 3; ++i)
#pragma unroll
        for (int j = i; j < 3; ++j, ++at) {
            c[at] = sum(kMoment + at) * inverse - mean[i] * mean[j];
            if (i == j) // a variance stays in the range that joined Gaussians can have, which rounding may leave
                c[at] = fminf(fmaxf(c[at], 0.0f), 1.25f) + rounding;
        }
#pragma unroll
    for (int i = 0; i < 3; ++i) { // off the diagonal: xy, xz, yz
        const uint32_t of[3] = {1, 2, 4}, first[3] = {0, 0, 3}, second[3] = {3, 5, 5};
        const float most = sqrtf(c[first[i]] * c[second[i]]);
        c[of[i]] = fminf(fmaxf(c[of[i]], -most), most);
    }
    const float square = group.frame.cell * group.frame.cell;
    for (float& entry : c)
        entry *= square;
    float direction[3];
    const float scale = __fdividef(1.0f, view.pixel_at_one * distanceTo(out.position, view.center, direction));
    const float x = direction[0], y = direction[1], z = direction[2];
    const float trace = c[0] + c[3] + c[5];
    const float along =
        c[0] * x * x + c[3] * y * y + c[5] * z * z + 2.0f * (c[1] * x * y + c[2] * x * z + c[4] * y * z);
    const float adjugate = fmaxf((c[3] * c[5] - c[4] * c[4]) * x * x + (c[0] * c[5] - c[2] * c[2]) * y * y +
                                     (c[0] * c[3] - c[1] * c[1]) * z * z +
                                     2.0f * ((c[2] * c[4] - c[1] * c[5]) * x * y + (c[1] * c[4] - c[2] * c[3]) * x * z +
                                             (c[1] * c[2] - c[0] * c[4]) * y * z),
                                 0.0f);
    const float light = weight * __fdividef(1.0f, kOne * group.most), area = screenArea(trace, along, adjugate, scale);
    const float depth = __fdividef(light, area) + kUndrawnDepth, wider = widening(depth);
    if (wider > 1.0f) {
        const float grows = growth(trace, along, adjugate, scale, wider * area);
        if (grows < kMostGrowth)
#pragma unroll
            for (float& entry : c)
                entry *= grows;
    }
    out.opacity = fminf(1.0f - __expf(-depth), kLargestOpacity);
    factorOf(c, 1e-3f * group.frame.cell, out.factor);
    out.order = cells.orders[cell];
    return out;
}

} // namespace gsc
