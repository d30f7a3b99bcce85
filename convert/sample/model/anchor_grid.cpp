// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model/anchor_grid.h"

#include "convert/sample/model/hash_random.h"
#include <gsc/gsc_layout.h>

namespace gsc {

AnchorGrid scaffoldGrid(double spacing)
{
    AnchorGrid grid;
    const double power = std::pow(10.0, std::floor(std::log10(spacing)));
    const double mantissa = spacing / power;
    const int digit = mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1;
    // note: digit / 10^n is the double nearest to the decimal number; digit * 10^-n is not
    const double decimals = std::round(-std::log10(power));
    grid.voxel_decimal = decimals >= 0 ? digit / std::pow(10.0, decimals) : digit * std::pow(10.0, -decimals);
    grid.quantum[0] = float(grid.voxel_decimal);
    return grid;
}

AnchorGrid octreeGrid(float low, float high, double spacing, uint32_t levels)
{
    AnchorGrid grid;
    grid.levels = levels;
    const float bmin = low * 1.1f, bmax = high * 1.1f;
    const float box = bmax - bmin;
    grid.base_layer = int(std::max(1.0, std::ceil(std::log2(double(box) / spacing))));
    const float voxel = float(double(box) / std::exp2(double(grid.base_layer)));
    for (uint32_t level = 0; level < levels; ++level)
        grid.quantum[level] = voxel / float(1u << level);
    grid.origin = bmin;
    return grid;
}

GridCell cellOf(const AnchorGrid& grid, uint32_t level, dvec3 position)
{
    return GridCell(glm::floor((position - double(grid.origin)) / double(grid.quantum[level]) + 0.5));
}

void cellPosition(const AnchorGrid& grid, uint32_t level, const GridCell& cell, float out[3])
{
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = gridCoordinate(cell[axis], grid.quantum[level], grid.origin, false);
}

TakenCells::TakenCells(const AnchorGrid& grid, bool bounded, const double min[2], const double max[2])
{
    for (uint32_t level = 0; level < grid.levels; ++level) {
        m_first[level] = GridCell(INT32_MIN);
        m_last[level] = GridCell(INT32_MAX);
        for (int axis = 0; bounded && axis < 2; ++axis) {
            const double q = grid.quantum[level];
            m_first[level][axis] = int32_t(std::ceil((min[axis] - double(grid.origin)) / q));
            m_last[level][axis] = int32_t(std::ceil((max[axis] - double(grid.origin)) / q)) - 1;
        }
    }
}

size_t TakenCells::KeyHash::operator()(const Key& key) const
{
    const glm::uvec3 cell(key.cell);
    return hashKey(uint64_t(cell.x) << 32 | cell.y, uint64_t(cell.z) << 8 | key.level);
}

// Moves the cell into the tile. A tile smaller than a cell has only its first cell.
GridCell TakenCells::inside(uint32_t level, GridCell cell) const
{
    return glm::max(m_first[level], glm::min(m_last[level], cell));
}

GridCell TakenCells::take(uint32_t level, GridCell wanted)
{
    const GridCell start = inside(level, wanted);
    // tries the cells at distance 0, 1, 2 and so on, always in the same order
    for (int32_t r = 0;; ++r)
        for (int32_t dz = -r; dz <= r; ++dz)
            for (int32_t dy = -r; dy <= r; ++dy)
                for (int32_t dx = -r; dx <= r; ++dx) {
                    if (std::max({std::abs(dx), std::abs(dy), std::abs(dz)}) != r)
                        continue;
                    const GridCell cell = start + GridCell(dx, dy, dz);
                    if (inside(level, cell) == cell && m_taken.insert({cell, level}).second)
                        return cell;
                }
}

} // namespace gsc
