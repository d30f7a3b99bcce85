// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/anchor_grid.h"

#include "convert/sample/hash_random.h"
#include "format/gsc_layout.h"

namespace gsc {

AnchorGrid scaffoldGrid(double spacing)
{
    AnchorGrid grid;
    const double power = std::pow(10.0, std::floor(std::log10(spacing)));
    const double mantissa = spacing / power;
    const int digit = mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1;
    // note: digit / 10^n is the double nearest to the decimal number, digit * 10^-n is not
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

GridCell cellOf(const AnchorGrid& grid, uint32_t level, Vec3 position)
{
    const auto index = [&](double x) {
        return int32_t(std::floor((x - double(grid.origin)) / double(grid.quantum[level]) + 0.5));
    };
    return {{index(position.x), index(position.y), index(position.z)}};
}

void cellPosition(const AnchorGrid& grid, uint32_t level, const GridCell& cell, float out[3])
{
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = gridCoordinate(cell.k[axis], grid.quantum[level], grid.origin, false);
}

void TakenCells::begin(const AnchorGrid& grid, bool bounded, const double min[2], const double max[2])
{
    m_bounded = bounded;
    for (uint32_t level = 0; bounded && level < grid.levels; ++level)
        for (int axis = 0; axis < 2; ++axis) {
            const double q = grid.quantum[level];
            m_min[level][axis] = int32_t(std::ceil((min[axis] - double(grid.origin)) / q));
            m_max[level][axis] = int32_t(std::ceil((max[axis] - double(grid.origin)) / q)) - 1;
        }
    m_slots.assign(1024, {{0, 0, 0}, kMaxSampleLevels});
    m_used = 0;
}

GridCell TakenCells::clamped(uint32_t level, GridCell cell) const
{
    for (int axis = 0; m_bounded && axis < 2; ++axis)
        cell.k[axis] = std::max(m_min[level][axis], std::min(m_max[level][axis], cell.k[axis]));
    return cell;
}

bool TakenCells::insert(uint32_t level, const GridCell& cell)
{
    const uint64_t key =
        hashKey(uint64_t(uint32_t(cell.k[0])) << 32 | uint32_t(cell.k[1]), uint64_t(uint32_t(cell.k[2])) << 8 | level);
    const size_t mask = m_slots.size() - 1;
    for (size_t i = key & mask;; i = (i + 1) & mask) {
        Slot& slot = m_slots[i];
        if (slot.level == kMaxSampleLevels) {
            slot = {{cell.k[0], cell.k[1], cell.k[2]}, level};
            if (++m_used * 2 > m_slots.size())
                grow();
            return true;
        }
        if (slot.level == level && slot.k[0] == cell.k[0] && slot.k[1] == cell.k[1] && slot.k[2] == cell.k[2])
            return false;
    }
}

void TakenCells::grow()
{
    std::vector<Slot> old(m_slots.size() * 2, Slot{{0, 0, 0}, kMaxSampleLevels});
    old.swap(m_slots);
    m_used = 0;
    for (const Slot& slot : old)
        if (slot.level != kMaxSampleLevels)
            insert(slot.level, {{slot.k[0], slot.k[1], slot.k[2]}});
}

GridCell TakenCells::take(uint32_t level, GridCell wanted)
{
    const GridCell start = clamped(level, wanted);
    if (insert(level, start))
        return start;
    // shells of growing size round the cell, in a fixed order
    for (int32_t r = 1;; ++r)
        for (int32_t dz = -r; dz <= r; ++dz)
            for (int32_t dy = -r; dy <= r; ++dy)
                for (int32_t dx = -r; dx <= r; ++dx) {
                    if (std::max({std::abs(dx), std::abs(dy), std::abs(dz)}) != r)
                        continue;
                    const GridCell cell{{start.k[0] + dx, start.k[1] + dy, start.k[2] + dz}};
                    const GridCell inside = clamped(level, cell);
                    if (inside.k[0] == cell.k[0] && inside.k[1] == cell.k[1] && insert(level, cell))
                        return cell;
                }
}

} // namespace gsc
