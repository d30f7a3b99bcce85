// SPDX-License-Identifier: Apache-2.0
// Selects the anchors that eyes see, on a CPU: by level first, then by the visibility test of the trainers' rasteriser
// (format facts 5).
#pragma once

#include "kernels/simd/buffer.h"
#include <gsc/frame_types.h>
#include "kernels/math/eye.h"

#include <vector>

namespace gsc {

class Workers;

struct VisibleAnchor {
    uint32_t chunk;
    uint32_t local;           // number of the anchor in its chunk
    uint32_t eyes;            // bit e is set if the anchor is visible to eye e
    float fraction[kMaxEyes]; // opacity factor for each eye, 1 unless levelsFade()
};

struct SelectArgs {
    const ModelView* model;
    const EyeParams* eyes; // eyes from whose centres levels are chosen; nothing else of them is used
    uint32_t eye_count;
    RasterConstants rules;
    float lod_bias;
    float lod_fade = 0;
    ColumnRange
        columns{}; // columns that are drawn: an anchor is visible only if its Gaussians can touch a tile of them
};

struct SelectCounts {
    uint64_t groups_tested[kMaxEyes];
    uint64_t anchors_tested[kMaxEyes];
    uint64_t anchors_visible[kMaxEyes];
};

// A group that may hold a visible anchor, and a bit for each of its anchors that is visible. Scratch of selectCpu().
struct GroupMask {
    uint32_t group;
    uint32_t first; // number of visible anchors in the groups before this one
    uint64_t visible[kMaxEyes][kGroupSize / 64];
};

// A group of which eyes may see something, judged by its bounds.
struct SeenGroup {
    uint32_t group;
    uint32_t eyes; // bit e is set if eye e may see something of the group
};

struct SelectScratch {
    Buffer<uint32_t> chunk_eyes;
    Buffer<SeenGroup> seen; // groups that eyes may see, from selectGroupsCpu()
    Buffer<GroupMask> groups;
    size_t group_count = 0; // number of entries of `groups` in use
    std::vector<SelectCounts> worker_counts;
};

// Lists the visible anchors of all eyes in file order, and returns their number; `visible` is made large enough. Chunks
// and groups are rejected by bounds, single anchors by the trainers' test, so the list equals that of a test of every
// anchor; with a band of columns it has only what the band may show.
size_t selectCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, Buffer<VisibleAnchor>& visible,
                 SelectCounts& counts);

// The two steps of selectCpu(), for a caller that draws only some groups from their anchors. The first lists in
// scratch.seen the groups that may hold a visible anchor, in file order, and returns their number. The second lists the
// visible anchors of `groups`, which must be in file order, too.
size_t selectGroupsCpu(const SelectArgs& args, const Workers& workers, SelectScratch& scratch, SelectCounts& counts);
size_t selectAnchorsCpu(const SelectArgs& args, const SeenGroup* groups, size_t group_count, const Workers& workers,
                        SelectScratch& scratch, Buffer<VisibleAnchor>& visible, SelectCounts& counts);

template <typename Real>
struct SelectedAnchor {
    uint32_t chunk, local;
    Real fraction;
};

// Scalar reference: tests every anchor for one eye. Real is float or double.
template <typename Real>
std::vector<SelectedAnchor<Real>> selectReference(const ModelView& model, const EyeOf<Real>& eye,
                                                  const RasterConstants& rules, Real lod_bias, Real lod_fade = Real(0));

} // namespace gsc
