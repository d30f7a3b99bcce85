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

constexpr uint32_t kPageGaussians = 32; // Gaussians of a page, one for each lane of a warp
constexpr uint32_t kMostPages = 24;     // largest number of pages of a copy; a group that needs more is drawn as near
constexpr uint32_t kCoarseUrgencies = 4096; // buckets of urgency, the most urgent first
constexpr uint32_t kCoarseAges = 1024; // buckets of frames since a copy was drawn; the last one holds all older copies
constexpr uint32_t kCoarseFewGroups = 2048; // with so few visible groups, one block is faster than three more launches
constexpr uint32_t kNoPage = ~0u;

// State of a group and its copy, kept from frame to frame.
struct alignas(16) CoarseGroup {
    CoarseKey key;
    uint32_t kind;    // a value of CoarseKind
    uint32_t count;   // number of Gaussians in the group's copy
    uint32_t anchors; // number of anchors that the copy was made of
    uint32_t source;  // number of Gaussians that the copy's anchors had
    uint32_t used;    // number of the frame that drew the copy last
    uint32_t made;    // number of the frame that made the copy, or found the group near
};
static_assert(sizeof(CoarseGroup) == 48);

GSC_HD uint32_t pagesOf(const CoarseGroup& group)
{
    return (group.count + kPageGaussians - 1) / kPageGaussians;
}

// A Gaussian of a copy takes two CoarseWords, kPageGaussians of them apart.
//   place      x, y, z from the low bits on, 21 bits each, in steps of the group's box
//   factor     L of the covariance L L^T in edges of a cell, halves: L00 L10, L20 L11, L21 L22
//   color, opacity: steps of 1/65535; order: emission order, which breaks ties of depth
struct alignas(16) CoarseWords {
    uint32_t word[4];
};
struct CoarsePage {
    CoarseWords first[kPageGaussians];  // place (2 numbers), factor (2)
    CoarseWords second[kPageGaussians]; // factor (1), red | green << 16, blue | opacity << 16, order
};
static_assert(sizeof(CoarsePage) == 1024);

// Histograms of a frame. They are zero between frames: coarseGrantCuda() clears them.
struct CoarseBuckets {
    uint32_t urgencies[kCoarseUrgencies]; // groups whose copy is due, by urgency
    uint32_t ages[kCoarseAges];           // pages of copies, by frames since the copy was drawn
};

// Ring of free pages, kept from frame to frame.
struct CoarseRing {
    unsigned long long taken, given; // pages taken from and given to the ring since the reset; given - taken are free
};

struct CoarseTables {    // tables of copies, all pointers to device memory
    CoarseGroup* groups; // group_count elements: state of every group of the model
    uint32_t* page_of;   // group_count x kMostPages elements: pages of each copy
    CoarsePage* pages;   // page_count pages
    uint32_t* ring;      // 2 x page_count elements: numbers of free pages
    uint32_t page_count, group_count;
    uint32_t* near;    // list of groups that are decoded for this frame: group | eyes << kAnchorBits
    uint32_t* drawn;   // list of groups that are drawn from copies: group | eyes << kAnchorBits
    uint32_t* wants;   // list of groups whose copies are to be made: group | eyes << kAnchorBits
    uint32_t* urgency; // for each visible group, in their order: bucket of urgency if a copy is wanted
    CoarseBuckets* buckets;
    CoarseRing* free;
};

// Values for coarse copies that change from frame to frame, in addition to FrameNow.
struct CoarseNow : FrameNow {
    CoarseView view;
    uint32_t frame;  // number of the frame, from 1; a frame that is drawn again keeps its number
    uint32_t again;  // not 0 if the frame is drawn again because a buffer was too small
    uint32_t budget; // largest number of copies that this frame may make
};

struct CoarseScheduleArgs {
    using Now = CoarseNow;

    CoarseNow now;
    DeviceModel model;
    uint32_t eye_count;
    RasterConstants rules;
    const uint32_t* visible_groups; // groups that eyes may see: group | eyes << kAnchorBits, as select lists them
    uint32_t* histogram;            // kDepthBuckets counts of visible anchors by view z, to which copies are added
    FrameCounters* frame;
    CoarseTables tables;
};

inline void setNow(CoarseScheduleArgs& args, const CoarseNow& now)
{
    args.now = now;
}

// Arguments of the kernels that decode groups for copies and that draw copies.
struct CoarseCudaArgs : DecodeCudaArgs {
    using Now = CoarseNow;

    CoarseTables tables;
    CoarseView view;
    uint32_t frame;      // number of the frame
    uint32_t* histogram; // kDepthBuckets counts of visible anchors by view z, to which copies are added
};

inline void setNow(CoarseCudaArgs& args, const CoarseNow& now)
{
    static_cast<FrameNow&>(args) = now;
    args.view = now.view;
    args.frame = now.frame;
}

// Arguments for painting FrameView::Detail and FrameView::Age.
struct PaintCoarseArgs {
    using Now = CoarseNow;

    PaintCudaArgs paint;
    CoarseTables tables;
    CoarseView view;
    uint32_t frame; // number of the frame
    bool ages;      // true for FrameView::Age, false for FrameView::Detail
};

inline void setNow(PaintCoarseArgs& args, const CoarseNow& now)
{
    args.view = now.view;
    args.frame = now.frame;
}

// Bring kernels to the device (loadKernel()), so that no frame waits for that.
void loadCoarseSchedule(bool few); // few: for models of kCoarseFewGroups or fewer
void loadCoarseMake(bool compact, bool bank);
void loadCoarseDraw();
// Forgets all copies. Asynchronous, as are all functions below.
void resetCoarseCuda(const CoarseTables& tables, uint32_t processors, CUstream_st* stream);
// The four steps that follow selection, in this order: find the change since each group's copy was made; grant copies
// to be made; evict copies, which give up their pages, the least recently drawn first; list what is drawn, and how.
void coarseScheduleCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseGrantCuda(const CoarseScheduleArgs& args, CUstream_st* stream);
void coarseEvictCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseListCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseDecideCuda(const CoarseScheduleArgs& args,
                      CUstream_st* stream); // does all four steps in one kernel, for kCoarseFewGroups or fewer
// Makes the wanted copies; adds groups that turn out to be near to the list of near groups. shared_bytes: as in
// DecodeCudaArgs.
void coarseMakeCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Projects copies to splats. To be called once in each pass.
void coarseDrawCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Paints the splats that were written by making and drawing copies. To be called after both.
void paintCoarseCuda(const PaintCoarseArgs& args, uint32_t processors, CUstream_st* stream);
// Largest number of splat slots of one eye that drawing leaves unused.
uint32_t coarseDrawGaps(uint32_t processors, uint32_t slot_capacity);

} // namespace gsc
