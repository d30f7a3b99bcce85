// SPDX-License-Identifier: Apache-2.0
// Selection of anchors that eyes see, on a CPU: LOD mask, then the rasteriser's own visibility test (format facts 5).
#pragma once

#include "kernels/simd/buffer.h"
#include <gsc/frame_types.h>
#include "kernels/math/eye.h"

#include <vector>

namespace gsc {

class Workers;

struct VisibleAnchor {
    uint32_t chunk;
    uint32_t local;           // in its chunk
    uint32_t eyes;            // bit e: visible to eye e
    float fraction[kMaxEyes]; // opacity factor per eye, 1 unless levelsFade()
};

struct SelectArgs {
    const ModelView* model;
    const EyeParams* eyes; // their centres are where levels are chosen from, and serve nothing else
    uint32_t eye_count;
    RasterConstants rules;
    float lod_bias;
    float lod_fade = 0;
    ColumnRange
        columns{}; // columns of tiles that are drawn: an anchor is visible only if its Gaussians can touch one of them
};

struct SelectCounts {
    uint64_t groups_tested[kMaxEyes];
    uint64_t anchors_tested[kMaxEyes];
    uint64_t anchors_visible[kMaxEyes];
};

// Groups that may hold a visible anchor, and which of their anchors do. Scratch of selectCpu().
struct GroupMask {
    uint32_t group;
    uint32_t first; // visible anchors of the groups before
    uint64_t visible[kMaxEyes][kGroupSize / 64];
};

// A group that eyes may see something of, by its bounds.
struct SeenGroup {
    uint32_t group;
    uint32_t eyes; // bit e: eye e
};

struct SelectScratch {
    Buffer<uint32_t> chunk_eyes;
    Buffer<SeenGroup> seen; // result of selectGroupsCpu()
    Buffer<GroupMask> groups;
    size_t group_count = 0; // entries of `groups` in use
    std::vector<SelectCounts> worker_counts;
};

// Visible anchors in file order, all eyes in one list. Returns how many; `visible` grows to hold them. Chunks and
// groups are rejected by bounds; the test of a single anchor is upstream's, so the set equals that of the flat pass; of
// a band of columns, it is what the band may show of it.
size_t selectCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, Buffer<VisibleAnchor>& visible,
                 SelectCounts& counts);

// Two steps of selectCpu(), for a caller that draws only some groups from their anchors. The first lists the groups
// that may hold a visible anchor, in file order in scratch.seen, and returns how many; the second lists the visible
// anchors of `groups`, which are in file order, too.
size_t selectGroupsCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, SelectCounts& counts);
size_t selectAnchorsCpu(const SelectArgs& args, const SeenGroup* groups, size_t group_count, const Workers& workers,
                        SelectScratch& scratch, Buffer<VisibleAnchor>& visible, SelectCounts& counts);

template <typename Real>
struct SelectedAnchor {
    uint32_t chunk, local;
    Real fraction;
};

// The flat pass over every anchor for one eye, scalar. Real is float or double.
template <typename Real>
std::vector<SelectedAnchor<Real>> selectReference(const ModelView& model, const EyeOf<Real>& eye,
                                                  const RasterConstants& rules, Real lod_bias, Real lod_fade = Real(0));

} // namespace gsc
