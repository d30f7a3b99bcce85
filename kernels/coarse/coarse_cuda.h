// SPDX-License-Identifier: Apache-2.0
// Coarse copies of groups on a device (README.md): tables, the decisions of a frame, and launches. Plain data, no CUDA
// header.
//
// A picture depends only on the frames before it: not on the order of atomics, nor on how often a frame was drawn again
// because a buffer was too small.
#pragma once

#include "kernels/coarse/coarse_rule.h"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/present/paint_cuda.h"
#include "kernels/select/select_cuda.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kPageGaussians = 32;     // a lane each
constexpr uint32_t kMostPages = 24;         // most pages of a copy; a group that needs more is drawn as near
constexpr uint32_t kCoarseUrgencies = 4096; // buckets, most urgent first
constexpr uint32_t kCoarseAges = 1024;      // buckets of frames since a copy was drawn; the last holds all older ones
constexpr uint32_t kCoarseFewGroups = 2048; // for so few groups one block is faster than three more launches
constexpr uint32_t kNoPage = ~0u;

// State of a group, kept from frame to frame.
struct alignas(16) CoarseGroup {
    CoarseKey key;
    uint32_t kind;    // CoarseKind
    uint32_t count;   // Gaussians of its copy
    uint32_t anchors; // anchors that its copy was made of
    uint32_t source;  // Gaussians of these anchors
    uint32_t used;    // frame that drew the copy last
    uint32_t made;    // frame that made the copy, or found the group near
};
static_assert(sizeof(CoarseGroup) == 48);

GSC_HD uint32_t pagesOf(const CoarseGroup& group)
{
    return (group.count + kPageGaussians - 1) / kPageGaussians;
}

// A Gaussian of a copy: two words, kPageGaussians words apart.
//   place      x, y, z from the low bits on, 21 bits each, in steps of the group's box
//   factor     L of the covariance L L^T in edges of a cell, halves: L00 L10, L20 L11, L21 L22
//   color, opacity: steps of 1/65535; order: emission order, which breaks ties of depth
struct alignas(16) CoarseWords {
    uint32_t word[4];
};
struct CoarsePage {
    CoarseWords first[kPageGaussians];  // place (2), factor (2)
    CoarseWords second[kPageGaussians]; // factor, red | green << 16, blue | opacity << 16, order
};
static_assert(sizeof(CoarsePage) == 1024);

// Histograms of a frame. Zero between frames: coarseGrantCuda() clears them.
struct CoarseBuckets {
    uint32_t urgencies[kCoarseUrgencies]; // groups
    uint32_t ages[kCoarseAges];           // pages
};

// Ring of free pages, kept from frame to frame.
struct CoarseRing {
    unsigned long long taken, given; // counted from the reset; given - taken pages are free
};

struct CoarseTables {    // device pointers
    CoarseGroup* groups; // groups of the model
    uint32_t* page_of;   // groups x kMostPages
    CoarsePage* pages;   // page_count
    uint32_t* ring;      // 2 x page_count
    uint32_t page_count, group_count;
    uint32_t* near;    // groups decoded for this frame: group | eyes << kAnchorBits
    uint32_t* drawn;   // groups drawn from copies: group | eyes << kAnchorBits
    uint32_t* wants;   // groups whose copies are to be made: group | eyes << kAnchorBits
    uint32_t* urgency; // for each group that is looked at, in their order: bucket of urgency if a copy is wanted
    CoarseBuckets* buckets;
    CoarseRing* free;
};

// Values that change from frame to frame, beside FrameNow.
struct CoarseNow : FrameNow {
    CoarseView view;
    uint32_t frame;  // counts from 1; a frame drawn again keeps its number
    uint32_t again;  // not 0: the frame is drawn again
    uint32_t budget; // most copies made in the frame
};

struct CoarseScheduleArgs {
    using Now = CoarseNow;

    CoarseNow now;
    DeviceModel model;
    uint32_t eye_count;
    RasterConstants rules;
    const uint32_t* visible_groups; // SelectCudaArgs
    uint32_t* histogram;            // SelectCudaArgs
    FrameCounters* frame;
    CoarseTables tables;
};

inline void setNow(CoarseScheduleArgs& args, const CoarseNow& now)
{
    args.now = now;
}

// Arguments of the kernels that decode groups and draw copies.
struct CoarseCudaArgs : DecodeCudaArgs {
    using Now = CoarseNow;

    CoarseTables tables;
    CoarseView view;
    uint32_t frame;      // CoarseNow
    uint32_t* histogram; // SelectCudaArgs
};

inline void setNow(CoarseCudaArgs& args, const CoarseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.view = now.view;
    args.frame = now.frame;
}

// Arguments for FrameView::Detail and FrameView::Age.
struct PaintCoarseArgs {
    using Now = CoarseNow;

    PaintCudaArgs paint;
    CoarseTables tables;
    CoarseView view;
    uint32_t frame; // CoarseNow
    bool ages;      // FrameView::Age
};

inline void setNow(PaintCoarseArgs& args, const CoarseNow& now)
{
    args.view = now.view;
    args.frame = now.frame;
}

// Brings the kernels to the device (loadKernel()), so that no frame waits for them.
void loadCoarseSchedule(bool few); // kCoarseFewGroups or fewer
void loadCoarseMake(bool compact, bool bank);
void loadCoarseDraw();
// Forgets all copies. Asynchronous, as all functions below.
void resetCoarseCuda(const CoarseTables& tables, uint32_t processors, CUstream_st* stream);
// Called after selection, in this order: change of each group's copy; which copies are made; which copies give up their
// pages, least recently drawn first; lists of what is drawn, and how.
void coarseScheduleCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseGrantCuda(const CoarseScheduleArgs& args, CUstream_st* stream);
void coarseEvictCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseListCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseDecideCuda(const CoarseScheduleArgs& args,
                      CUstream_st* stream); // all four steps in one kernel, for kCoarseFewGroups or fewer
// Makes the wanted copies; adds groups that turn out to be near to that list. shared_bytes: DecodeCudaArgs.
void coarseMakeCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Projects copies to splats. Called once per pass.
void coarseDrawCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Paints the splats that making and drawing wrote. Called after both.
void paintCoarseCuda(const PaintCoarseArgs& args, uint32_t processors, CUstream_st* stream);
// Most splat slots that drawing leaves unused, for one eye.
uint32_t coarseDrawGaps(uint32_t processors, uint32_t slot_capacity);

} // namespace gsc
