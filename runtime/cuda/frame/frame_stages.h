// SPDX-License-Identifier: Apache-2.0
// A frame of the CUDA backend without reuse: memory and arguments of the stages. Reuse joins through FrameReuse.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/blend/blend_cuda.h"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/present/paint_cuda.h"
#include "kernels/select/select_cuda.h"
#include "runtime/cuda/device/device_buffer.h"
#include "runtime/cuda/device/device_scene.h"
#include "runtime/cuda/frame/frame_capture.h"
#include "runtime/cuda/frame/frame_plan.h"

namespace gsc {

// Properties on which a captured graph depends, beside the capacity. Frames of one shape differ in FrameNow alone.
struct FrameShape {
    uint32_t eye_count;
    uint32_t width[kMaxEyes], height[kMaxEyes]; // size of each eye's picture, pixels
    BinGrid grid;                               // bins, which cover the larger eye
    uint32_t passes;
    RasterConstants rules;
    bool exact;       // tier exact, with the scalar decode and splats of 48 bytes
    bool fades;       // anchors have opacity factors, because levels fade
    bool merged;      // one decode serves both eyes
    bool shared_bins; // both eyes share one list of splats for each bin
    bool uses_reuse;  // the frame reuses Gaussians, which needs tier fast and one pass
    bool coarse;      // the frame uses coarse copies (FrameOptions::detail), which needs tier fast
    bool thins;       // foveation leaves out small Gaussians
    bool depths;      // the depth of each pixel is drawn, because a target wants it
    float background[3];
    int32_t appearance;
    bool empty_is_black;
    FrameView view;
    LensShape lens[kMaxEyes]; // visible part of each eye's picture; a new lens needs a new graph

    bool operator==(const FrameShape&) const = default;

    // Decides if both eyes can share one list of splats for each bin: in tier fast, if a point has the same depth in
    // both. The second eye's depths are then made equal to the first's to the last bit. If the eyes' lenses are off
    // their axes, the shared columns are shifted by the distance between the two images of a far point. Precondition:
    // all other members are set.
    void shareBins(EyeParams* eyes);
    // number of lists of splats for each bin
    [[nodiscard]] uint32_t lists() const { return shared_bins ? 1 : eye_count; }

    [[nodiscard]] size_t splatBytes() const { return exact ? sizeof(ExactSplat) : sizeof(PackedSplat); }
    [[nodiscard]] uint32_t cells() const { return lists() * grid.cells(); }
    [[nodiscard]] uint32_t bins() const { return lists() * grid.bins(); }
    [[nodiscard]] size_t pixels(uint32_t eye) const { return size_t(width[eye]) * height[eye]; }
};

// Returns the shape of a frame in `tier` that is drawn in one pass. shareBins() may change `eyes` by a rounding.
// Throws Error(Unsupported) for options that cannot be drawn.
FrameShape frameShape(const ModelParams& params, Tier tier, uint32_t eye_count, const FrameOptions& options,
                      EyeParams* eyes);

void setFoveation(const Foveation& foveation, FrameNow& now);

// Bytes of the histogram and of the counters behind it that are set to 0 when a frame starts; the times are not.
constexpr size_t kClearedBytes = kDepthBuckets * sizeof(uint32_t) + offsetof(FrameCounters, stage_ns);

struct FrameBuffers { // buffers of a frame, as pointers into device memory
    FrameCounters* counters;
    uint32_t *visible_groups, *visible, *histogram, *cells, *bin_class, *bin_queue, *bin_units;
    float *fraction, *scratch; // fading factors, null if nothing fades; scratch memory, null if none is needed
    uint32_t* listed;          // anchors of the current pass; null if there is only one pass
    float* listed_fraction;
    uint16_t* slab_of;
    unsigned char* splats;
    SplatPlace* places;
    uint16_t* touches; // bins that each splat touches; null in tier exact
    SortKey* keys;
    uint32_t* wide;
    Piece* pieces;
    TouchUnit* touch_units;
    uint32_t *touch, *unfinished, *segment_pairs, *segment_queue;
    SegmentState* segment_states;
    SegmentPixel* segments;
    unsigned char* scan_scratch;
    size_t scan_bytes;
    float *image[kMaxEyes], *transmittance[kMaxEyes], *depth[kMaxEyes];
};

// Lays out the buffers of a frame.
FrameBuffers layOutFrame(ArenaLayout& layout, const DeviceScene& scene, const FrameShape& shape,
                         const FrameCapacity& capacity, const CudaLimits& limits);

// All inputs of a frame's stages. The arguments of a stage are copies of these.
struct FrameJob {
    const DeviceScene& scene;
    const FrameShape& shape;
    const FrameNow& now;
    const FrameCapacity& capacity;
    const FrameBuffers& buffers;
    const CudaLimits& limits;
    uint32_t flight; // index of the flight whose host memory the frame uses, below kFramesInFlight
};

// Interface of reuse: replaces two stages of a frame. The frame itself knows nothing else of reuse. The functions are
// called while a graph is captured.
class FrameReuse {
public:
    virtual ~FrameReuse() = default;
    virtual void prepareFrame(FrameCapture&, const FrameJob&) const {}
    // Lists the anchors of the visible groups.
    virtual void listAnchors(FrameCapture& capture, const FrameJob& job) const = 0;
    virtual void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const = 0;
    virtual void report(FrameCapture&, const FrameJob&) const {}
};

// Stages and their arguments, in the order of a frame; those from decode to blend are called once for each pass.
SelectCudaArgs selectArgs(const FrameJob& job);
// returns the arguments of the decode kernel for tier fast
DecodeCudaArgs decodeArgs(const FrameJob& job, uint32_t pass);
void cutDepths(FrameCapture& capture, const FrameJob& job); // cuts the range of depths into slabs
// Lists the anchors of a pass, if there are several passes.
void listPass(FrameCapture& capture, const FrameJob& job, uint32_t pass);
void decodeFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);
PaintCudaArgs paintArgs(const FrameJob& job); // returns the arguments of the paint kernel, with the model's origins
void paintFrame(FrameCapture& capture,
                const FrameJob& job); // paints Gaussians in false colours; kept ones are painted by FrameReuse
void binFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);
void sortFrame(FrameCapture& capture, const FrameJob& job);
void blendFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);

} // namespace gsc
