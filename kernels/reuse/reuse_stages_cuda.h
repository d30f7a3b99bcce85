// SPDX-License-Identifier: Apache-2.0
// Stages of a frame with reuse. Such a frame lists strips in place of anchors, decodes those that are due into entries,
// and draws entries. Between listing and decoding the schedule decides (reuse_cuda.h).
#pragma once

#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/present/paint_cuda.h"
#include "kernels/reuse/reuse_cuda.h"
#include "kernels/select/select_cuda.h"

namespace gsc {

// Arguments for selecting strips: these go to tables.listed in place of the visible list, and `fraction` has an element
// for each listed strip, eye and anchor of the strip.
struct StripSelectArgs : SelectCudaArgs {
    using Now = ReuseNow;

    ReuseTables tables;
    uint32_t frame; // number of the frame
};

inline void setNow(StripSelectArgs& args, const ReuseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.frame = now.frame;
}

// Arguments for decoding and drawing strips. The visible list is not used, and `fraction` has an element for each
// listed strip, eye and row.
struct KeepCudaArgs : DecodeCudaArgs {
    using Now = ReuseNow;

    ReuseTables tables;
    bool merged;    // true if both eyes share entries, decoded from look_from
    uint32_t frame; // number of the frame
};

inline void setNow(KeepCudaArgs& args, const ReuseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.frame = now.frame;
}

// Arguments for painting FrameView::Age.
struct PaintKeptArgs {
    using Now = ReuseNow;

    PaintCudaArgs paint;
    ReuseTables tables;
    bool merged;    // true if both eyes share entries
    uint32_t frame; // number of the frame
};

inline void setNow(PaintKeptArgs& args, const ReuseNow& now)
{
    args.frame = now.frame;
}

// Lists the strips of the visible groups that have a visible anchor.
void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream);

// Decodes the strips that are due, each with all of its anchors, into their entries; draws a strip directly if another
// one holds its cache slot. In one pass.
void decodeKeepCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Draws the strips that are listed to be drawn from entries. To be called after decodeKeepCuda().
void drawKeptCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Paints the splats that decodeKeepCuda() and drawKeptCuda() wrote. To be called after both.
void paintKeptCuda(const PaintKeptArgs& args, uint32_t processors, CUstream_st* stream);
// Largest number of splat slots of one eye that drawKeptCuda(), and also decodeKeepCuda(), leaves unused: see
// decodeFastGaps().
uint32_t drawKeptGaps(uint32_t processors, uint32_t slot_capacity);

} // namespace gsc
