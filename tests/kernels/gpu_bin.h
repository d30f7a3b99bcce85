// SPDX-License-Identifier: Apache-2.0
// The stage bin of the device on places made by hand.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "tests/kernels/gpu_stage.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace gsc::test {

struct Places {
    BinGrid grid;
    uint32_t eye_count;
    uint32_t slots[kMaxEyes]; // reserved, may exceed the capacity
    uint32_t slot_capacity;
    std::vector<SplatPlace> places; // eye_count x slot_capacity
    std::vector<uint16_t> slab_of;
};

Places emptyPlaces(const BinGrid& grid, uint32_t eye_count, uint32_t slots, uint32_t slot_capacity);
// Boxes of one bin, of a few, of the whole grid, and none, at random.
Places randomPlaces(const BinGrid& grid, uint32_t eye_count, uint32_t slots, uint32_t slot_capacity, uint32_t seed);

// Content that the cells of places must have.
struct Expected {
    std::vector<std::vector<std::pair<uint32_t, uint32_t>>> cells; // slot, depth; sorted
    std::vector<uint32_t> counts, ends;
    uint32_t pairs[kMaxEyes] = {};

    explicit Expected(const Places& p) : cells(size_t(p.eye_count) * p.grid.cells())
    {
        for (uint32_t e = 0; e < p.eye_count; ++e)
            for (uint32_t i = 0; i < std::min(p.slots[e], p.slot_capacity); ++i) {
                const uint32_t slot = e * p.slot_capacity + i;
                forCells(p.grid, p.slab_of, p.places[slot], [&](uint32_t cell) {
                    cells[size_t(e) * p.grid.cells() + cell].push_back({slot, p.places[slot].depth_bits});
                    ++pairs[e];
                });
            }
        for (auto& cell : cells) {
            std::sort(cell.begin(), cell.end());
            counts.push_back(uint32_t(cell.size()));
            ends.push_back((ends.empty() ? 0u : ends.back()) + counts.back());
        }
    }
    [[nodiscard]] uint32_t startOf(size_t cell) const { return cell == 0 ? 0u : ends[cell - 1]; }
};

// Bins places on the device, and checks all that comes of it.
void checkBin(const Places& places, uint32_t pair_capacity, uint32_t readers = 1);
// checkBin() with room for all.
void checkWithRoom(const Places& places);

} // namespace gsc::test
