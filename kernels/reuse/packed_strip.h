// SPDX-License-Identifier: Apache-2.0
// A decoded strip as it is kept to be drawn: only Gaussians that can show, from one key or between two (strip.h).
// Drawing what is kept waits for memory, so what counts is how many bytes a Gaussian takes: 36 with one key, 49 with
// two, and none where its opacity stays below kOpacityFloor, as a third of them do in the trained models.
#pragma once

#include "kernels/reuse/strip.h"
#include "kernels/reuse/reuse_math.h"

namespace gsc {

// Packed Gaussians come in cells of this many, whole cells of rows, the last one filled up with opacity -1.
constexpr uint32_t kCellGaussians = 16;

struct alignas(64) PackedStrip {
    uint32_t cells;
    uint16_t positive[2]; // per key, bit i: anchor i has an opacity above zero, packed or not (trap 25)
    float scale_unit;     // world units of a stored scale of 1, a power of two
};

// The cells follow PackedStrip: all the first keys, then, with two keys, all the second.
struct alignas(64) FirstCell {
    float position[3][kCellGaussians];
    uint16_t origin[kCellGaussians];          // offset * kStripAnchors + anchor of the strip
    uint16_t key[kStripRows][kCellGaussians]; // halves, in the order of strip.h, but for scales in scale_unit
};

// Differences of the second key from the first, in steps of a 127th of the cell's largest difference. From key to key
// that is a few 1/255, so that a step is about as fine as a half.
struct alignas(16) SecondCell {
    uint16_t opacity[kCellGaussians];           // half, exactly as decoded: it decides which Gaussians are drawn
    int8_t key[kStripRows - 1][kCellGaussians]; // the rest; scales relative to the first key's
    float color_step, scale_step, rotation_step;
    float reserved;
};
static_assert(sizeof(PackedStrip) == 64 && sizeof(FirstCell) == 576 && sizeof(SecondCell) == 208);

// Bytes of a strip all of whose Gaussians show; whole cache lines.
constexpr size_t packedStripBytes(uint32_t n_offsets)
{
    return sizeof(PackedStrip) + (n_offsets * (sizeof(FirstCell) + sizeof(SecondCell)) + 63) / 64 * 64;
}

struct PackScratch {
    Buffer<float> rows;
    Buffer<uint16_t> origins;
};

// Values of a row of PackScratch: room to fill up a cell and for a vector that reaches beyond.
constexpr size_t packStride(uint32_t n_offsets)
{
    return size_t(n_offsets + 2) * kStripAnchors;
}

// Makes `scratch` fit the model. One scratch per worker.
void reservePack(uint32_t n_offsets, PackScratch& scratch);

struct PackedExtent {
    uint32_t one, two; // bytes
};

// Decoded strip to be packed: outputs of decodeStripCpu() for its `count` anchors.
struct StripPack {
    const uint16_t* keys[2]; // the second is null for a single key
    const float* fixed;
    uint32_t count;
    uint32_t n_offsets;
};

// Packs a strip into packedStripBytes() at `packed`, aligned to 64. Returns how many of those bytes drawing reads, with
// one key and with two.
PackedExtent packStripCpu(const StripPack& pack, PackScratch& scratch, std::byte* packed);

struct StripMix {
    const std::byte* packed;
    float t;               // 0 draws the first key, 1 the second; beyond, on along the line. 0 for one key
    const float* fraction; // opacity factor per anchor, or null for 1
    uint32_t lanes;        // bit i: anchor i is drawn
    uint32_t n_offsets;
    uint32_t first_origin; // GaussianBlock::origin of offset 0 of anchor 0
};

// Appends the Gaussians whose opacity reaches kOpacityFloor; block.any_positive tells of any above zero (trap 25).
void mixStripCpu(const StripMix& mix, GaussianBlock& block);

} // namespace gsc
