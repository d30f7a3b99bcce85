// SPDX-License-Identifier: Apache-2.0
// Stages of a frame with reuse, in place of the plain ones: it lists strips in place of anchors, decodes those that are
// due into entries, and draws entries. Between listing and decoding the schedule decides (reuse_cuda.h).
#pragma once

#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/present/paint_cuda.h"
#include "kernels/reuse/reuse_cuda.h"
#include "kernels/select/select_cuda.h"

namespace gsc {

// Strips go to tables.listed in place of the visible list, and `fraction` is per listed strip, eye and anchor of the
// strip.
struct StripSelectArgs : SelectCudaArgs {
    using Now = ReuseNow;

    ReuseTables tables;
    uint32_t frame; // ReuseNow
};

inline void setNow(StripSelectArgs& args, const ReuseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.frame = now.frame;
}

// The visible list means nothing, and `fraction` is per listed strip, eye and row.
struct KeepCudaArgs : DecodeCudaArgs {
    using Now = ReuseNow;

    ReuseTables tables;
    bool merged;    // ReuseNow: decoded from look_from
    uint32_t frame; // ReuseNow
};

inline void setNow(KeepCudaArgs& args, const ReuseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.frame = now.frame;
}

// FrameView::Age.
struct PaintKeptArgs {
    using Now = ReuseNow;

    PaintCudaArgs paint;
    ReuseTables tables;
    bool merged;    // ReuseNow
    uint32_t frame; // ReuseNow
};

inline void setNow(PaintKeptArgs& args, const ReuseNow& now)
{
    args.frame = now.frame;
}

// lists strips of the visible groups
void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream);

// Decodes the due strips, all anchors of each, into their entries; draws a strip directly if another holds its cache
// slot. One pass.
void decodeKeepCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Draws the strips that are listed to be drawn from entries. After decodeKeepCuda().
void drawKeptCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Paints the splats that both wrote. After both.
void paintKeptCuda(const PaintKeptArgs& args, uint32_t processors, CUstream_st* stream);
// Most splat slots that stay unused, for decodeKeepCuda() too: see decodeFastGaps().
uint32_t drawKeptGaps(uint32_t processors, uint32_t slot_capacity);

} // namespace gsc
