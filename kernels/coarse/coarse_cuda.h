// SPDX-License-Identifier: Apache-2.0
// Coarse copies of groups on a device (README.md): what is kept, what a frame decides, and its launches. Plain data, no
// CUDA header.
//
// A picture depends on nothing but the frames so far: not on the order of atomics, and not on how often a frame was
// drawn again because a buffer was too small.
#pragma once

#include "kernels/coarse/coarse_rule.h"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/present/paint_cuda.h"
#include "kernels/select/select_cuda.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kPageGaussians = 32;     // one for each lane
constexpr uint32_t kMostPages = 24;         // of a copy; what would take more is near
constexpr uint32_t kCoarseUrgencies = 4096; // buckets, most urgent first
constexpr uint32_t kCoarseAges = 1024;      // buckets of frames since a copy was drawn; the last: as many or more
constexpr uint32_t kCoarseFewGroups = 2048; // a block decides about as many sooner than three more launches take
constexpr uint32_t kNoPage = ~0u;

// Kept of a group.
struct alignas(16) CoarseGroup {
    CoarseKey key;
    uint32_t kind;    // CoarseKind
    uint32_t count;   // Gaussians of its copy
    uint32_t anchors; // that its copy was made of
    uint32_t source;  // Gaussians of these
    uint32_t used;    // frame that drew it last
    uint32_t made;    // frame that made it, or found it near
};
static_assert(sizeof(CoarseGroup) == 48);

GSC_HD uint32_t pagesOf(const CoarseGroup& group)
{
    return (group.count + kPageGaussians - 1) / kPageGaussians;
}

// A Gaussian of a copy, as two words that lie a page's length apart.
//   place      x, y, z from the low bits on, 21 bits each, in steps of the group's box
//   factor     L of the covariance L L^T in edges of a cell, halves: L00 L10, L20 L11, L21 L22
//   color, opacity: steps of 1/65535; order: of emission, breaks depth ties
struct alignas(16) CoarseWords {
    uint32_t word[4];
};
struct CoarsePage {
    CoarseWords first[kPageGaussians];  // place (2), factor (2)
    CoarseWords second[kPageGaussians]; // factor, red | green << 16, blue | opacity << 16, order
};
static_assert(sizeof(CoarsePage) == 1024);

// Zero between frames: who grants clears them.
struct CoarseBuckets {
    uint32_t urgencies[kCoarseUrgencies]; // groups
    uint32_t ages[kCoarseAges];           // pages
};

// Kept from frame to frame: a ring of pages that are free.
struct CoarseRing {
    unsigned long long taken, given; // since the reset; given - taken are free
};

struct CoarseTables {    // device pointers
    CoarseGroup* groups; // of the model
    uint32_t* page_of;   // groups x kMostPages
    CoarsePage* pages;   // page_count
    uint32_t* ring;      // 2 x page_count
    uint32_t page_count, group_count;
    uint32_t* near;    // groups: decoded for this frame: group | eyes << kAnchorBits
    uint32_t* drawn;   // the same: from copies
    uint32_t* wants;   // the same: to be made
    uint32_t* urgency; // of the groups that are looked at, in their order: of those that are wanted the bucket
    CoarseBuckets* buckets;
    CoarseRing* free;
};

// Changes from frame to frame beside FrameNow.
struct CoarseNow : FrameNow {
    CoarseView view;
    uint32_t frame;  // counts from 1; a frame drawn again has the same
    uint32_t again;  // other than 0: it is
    uint32_t budget; // groups that are made at most
};

struct CoarseScheduleArgs {
    using Now = CoarseNow;

    CoarseNow now;
    DeviceModel model;
    uint32_t eye_count;
    RasterConstants rules;
    const uint32_t* visible_groups; // SelectCudaArgs
    uint32_t* histogram;            // the same
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

// FrameView::Detail and Age.
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
// Forgets everything. Asynchronous, as all.
void resetCoarseCuda(const CoarseTables& tables, uint32_t processors, CUstream_st* stream);
// After the groups are selected, one after the other: how far each is off; which may be made; which copies go for others,
// those drawn least recently; what is drawn, and how.
void coarseScheduleCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseGrantCuda(const CoarseScheduleArgs& args, CUstream_st* stream);
void coarseEvictCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseListCuda(const CoarseScheduleArgs& args, uint32_t processors, CUstream_st* stream);
void coarseDecideCuda(const CoarseScheduleArgs& args, CUstream_st* stream); // all four, of kCoarseFewGroups or fewer
// Makes copies of what is wanted; what turns out to be near is listed there. shared_bytes: DecodeCudaArgs.
void coarseMakeCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Copies to splats. Once per pass.
void coarseDrawCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream);
// After both: paints what they wrote.
void paintCoarseCuda(const PaintCoarseArgs& args, uint32_t processors, CUstream_st* stream);
// Slots that may stay unused by it, for one eye.
uint32_t coarseDrawGaps(uint32_t processors, uint32_t slot_capacity);

} // namespace gsc
