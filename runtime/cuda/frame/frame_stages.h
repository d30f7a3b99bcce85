// SPDX-License-Identifier: Apache-2.0
// A plain frame of the CUDA backend: its memory and the arguments of its stages. Reuse joins it through FrameReuse.
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

// Properties that a captured frame depends on, beside its capacity. Frames of one shape differ in FrameNow alone.
struct FrameShape {
    uint32_t eye_count;
    uint32_t width[kMaxEyes], height[kMaxEyes]; // pixels
    BinGrid grid;                               // sized for the larger eye
    uint32_t passes;
    RasterConstants rules;
    bool exact;       // the scalar decode and 48-byte splats
    bool fades;       // anchors have opacity factors
    bool merged;      // one decode for both eyes
    bool shared_bins; // one list of splats per bin for both eyes
    bool uses_reuse;  // one pass, `fast`
    bool coarse;      // FrameOptions::detail, `fast`
    bool thins;       // foveation
    bool depths;      // draw the depth of pixels, for a target that wants it
    float background[3];
    int32_t appearance;
    bool empty_is_black;
    FrameView view;
    LensShape lens[kMaxEyes]; // changes only if the lens changes

    bool operator==(const FrameShape&) const = default;

    // Gives both eyes the same bins where their depth order is the same and the tier allows it; the second eye's depths
    // then become the first's to the last bit. Eyes whose lenses are off their axes share columns, shifted by the
    // distance of a far point's two images. Precondition: everything else is set.
    void shareBins(EyeParams* eyes);
    [[nodiscard]] uint32_t lists() const { return shared_bins ? 1 : eye_count; } // lists of splats per bin

    [[nodiscard]] size_t splatBytes() const { return exact ? sizeof(ExactSplat) : sizeof(PackedSplat); }
    [[nodiscard]] uint32_t cells() const { return lists() * grid.cells(); }
    [[nodiscard]] uint32_t bins() const { return lists() * grid.bins(); }
    [[nodiscard]] size_t pixels(uint32_t eye) const { return size_t(width[eye]) * height[eye]; }
};

// Shape of a frame that is drawn in `tier`, in one pass. `eyes` may change by a rounding (shareBins()). Throws
// Error(Unsupported) for options that cannot be drawn.
FrameShape frameShape(const ModelParams& params, Tier tier, uint32_t eye_count, const FrameOptions& options,
                      EyeParams* eyes);

void setFoveation(const Foveation& foveation, FrameNow& now);

// The histogram and the counters behind it, zero when a frame starts, but for the times.
constexpr size_t kClearedBytes = kDepthBuckets * sizeof(uint32_t) + offsetof(FrameCounters, stage_ns);

struct FrameBuffers { // device memory
    FrameCounters* counters;
    uint32_t *visible_groups, *visible, *histogram, *cells, *bin_class, *bin_queue, *bin_units;
    float *fraction, *scratch; // may be null
    uint32_t* listed;          // anchors of a pass, if there are several; else null
    float* listed_fraction;
    uint16_t* slab_of;
    unsigned char* splats;
    SplatPlace* places;
    uint16_t* touches; // null in `exact`
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

// Lays a frame's buffers out.
FrameBuffers layOutFrame(ArenaLayout& layout, const DeviceScene& scene, const FrameShape& shape,
                         const FrameCapacity& capacity, const CudaLimits& limits);

// Everything the stages need. The arguments that a stage gets are copies.
struct FrameJob {
    const DeviceScene& scene;
    const FrameShape& shape;
    const FrameNow& now;
    const FrameCapacity& capacity;
    const FrameBuffers& buffers;
    const CudaLimits& limits;
    uint32_t flight; // number of the flight, below kFramesInFlight, whose host memory the frame uses
};

// Interface of reuse: replaces two stages of a plain frame, which knows nothing else of it. Called while a frame is
// captured.
class FrameReuse {
public:
    virtual ~FrameReuse() = default;
    virtual void prepareFrame(FrameCapture&, const FrameJob&) const {}
    // lists anchors of the visible groups
    virtual void listAnchors(FrameCapture& capture, const FrameJob& job) const = 0;
    virtual void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const = 0;
    virtual void report(FrameCapture&, const FrameJob&) const {}
};

// In this order; decode to blend once per pass.
SelectCudaArgs selectArgs(const FrameJob& job);
DecodeCudaArgs decodeArgs(const FrameJob& job, uint32_t pass); // arguments of the tier `fast`
void cutDepths(FrameCapture& capture, const FrameJob& job);    // into slabs
// lists the anchors of a pass, if there are several
void listPass(FrameCapture& capture, const FrameJob& job, uint32_t pass);
void decodeFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);
PaintCudaArgs paintArgs(const FrameJob& job); // with the model's origins
void paintFrame(FrameCapture& capture,
                const FrameJob& job); // false colours of Gaussians; kept Gaussians are painted by their FrameReuse
void binFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);
void sortFrame(FrameCapture& capture, const FrameJob& job);
void blendFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass);

} // namespace gsc
