// SPDX-License-Identifier: Apache-2.0
// A decoded strip in the form in which it is kept and drawn, at one key or between two (strip.h). It has only Gaussians
// that can be visible. Drawing kept strips waits for memory, so the bytes of a Gaussian matter: 36 with one key, 49
// with two, none if its opacity stays below kOpacityFloor, as a third of them do in the trained models.
#pragma once

#include "kernels/reuse/strip.h"
#include "kernels/reuse/reuse_math.h"

namespace gsc {

// Number of packed Gaussians in a cell of rows; the last cell is filled up with opacity -1.
constexpr uint32_t kCellGaussians = 16;

struct alignas(64) PackedStrip {
    uint32_t cells;
    // for each key: bit i is set if anchor i has an opacity above zero, packed or not (format facts, trap 25)
    uint16_t positive[2];
    float scale_unit; // world units that a stored scale of 1 means, a power of two
};

// Values of a cell's Gaussians at the first key. Behind PackedStrip lie all FirstCells, then, with two keys,
// SecondCells.
struct alignas(64) FirstCell {
    float position[3][kCellGaussians];
    uint16_t origin[kCellGaussians];          // offset * kStripAnchors + number of the anchor in the strip
    uint16_t key[kStripRows][kCellGaussians]; // half floats in the order of strip.h; scales are in units of scale_unit
};

// Differences of a cell's second key from its first, in steps of 1/127 of the cell's largest difference. A difference
// is a few 1/255, so that a step is about as fine as a half float.
struct alignas(16) SecondCell {
    // half floats of the opacity itself, exactly as decoded, since it decides which Gaussians are drawn
    uint16_t opacity[kCellGaussians];
    int8_t key[kStripRows - 1][kCellGaussians]; // differences of the other rows; of scales relative to the first key's
    float color_step, scale_step, rotation_step;
    float reserved;
};
static_assert(sizeof(PackedStrip) == 64 && sizeof(FirstCell) == 576 && sizeof(SecondCell) == 208);

// Bytes of a packed strip all of whose Gaussians can be visible; whole cache lines.
constexpr size_t packedStripBytes(uint32_t n_offsets)
{
    return sizeof(PackedStrip) + (n_offsets * (sizeof(FirstCell) + sizeof(SecondCell)) + 63) / 64 * 64;
}

struct PackScratch {
    Buffer<float> rows;
    Buffer<uint16_t> origins;
};

// Number of values in a row of PackScratch, with room to fill up a cell and for a vector that reaches beyond.
constexpr size_t packStride(uint32_t n_offsets)
{
    return size_t(n_offsets + 2) * kStripAnchors;
}

// Makes `scratch` large enough for the model. Each worker needs a scratch of its own.
void reservePack(uint32_t n_offsets, PackScratch& scratch);

struct PackedExtent {
    uint32_t one, two; // bytes that drawing reads with one key, and with two
};

// A decoded strip that is to be packed: outputs of decodeStripCpu() for its `count` anchors.
struct StripPack {
    const uint16_t* keys[2]; // the second one is null for a single key
    const float* fixed;
    uint32_t count;
    uint32_t n_offsets;
};

// Packs a strip into packedStripBytes() bytes at `packed`, aligned to 64. Returns how many of these bytes drawing
// reads, with one key and with two.
PackedExtent packStripCpu(const StripPack& pack, PackScratch& scratch, std::byte* packed);

struct StripMix {
    const std::byte* packed;
    float t;               // 0 draws the first key, 1 the second, others points on the line beyond; 0 for one key
    const float* fraction; // opacity factor of each anchor; null if all are 1
    uint32_t lanes;        // bit i is set if anchor i is drawn
    uint32_t n_offsets;
    uint32_t first_origin; // GaussianBlock::origin of offset 0 of the strip's anchor 0
};

// Appends to `block` the Gaussians of a packed strip whose opacity is kOpacityFloor or more, at a place between the
// keys. Sets block.any_positive if some opacity is above zero (format facts, trap 25).
void mixStripCpu(const StripMix& mix, GaussianBlock& block);

} // namespace gsc
