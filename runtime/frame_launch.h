// SPDX-License-Identifier: Apache-2.0
// A frame of the CUDA backend: its memory and its launches.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/decode/decode_cuda.h"
#include "kernels/select/select_cuda.h"
#include "kernels/sort/order_cuda.h"
#include "runtime/cuda_device.h"
#include "runtime/device_buffer.h"
#include "runtime/device_scene.h"
#include "runtime/frame_plan.h"
#include "runtime/order_cuda.h"
#include "runtime/reuse_cuda.h"

namespace gsc {

// The grid of bins is as large as the larger eye needs.
struct FrameShape {
    EyeParams eyes[kMaxEyes];
    uint32_t eye_count;
    BinGrid grid;
    uint32_t passes;
    RasterConstants rules;
    bool exact;       // the scalar decode and 64-byte splats
    bool fades;       // anchors have opacity factors
    bool merged;      // one decode for both eyes
    bool shared_bins; // one list of splats per bin for both eyes
    bool keeps;       // draws what earlier frames decoded: one pass, `fast`, not merged
    bool budgeted;    // CudaReuse::budgeted()
    bool cuts;        // selects with the cut cache
    bool orders;      // lists are cut by the last frame's order, and this one's is noted: one pass

    // Gives both eyes the same bins where their depth order is the same and the tier allows it. Eyes whose lenses are
    // off their axes meet in columns shifted by what that makes of a point far away. Precondition: everything else is set.
    void shareBins();
    [[nodiscard]] uint32_t lists() const { return shared_bins ? 1 : eye_count; } // of splats per bin

    [[nodiscard]] size_t splatBytes() const { return exact ? sizeof(ExactSplat) : sizeof(PackedSplat); }
    [[nodiscard]] uint32_t cells() const { return lists() * grid.cells(); }
    [[nodiscard]] uint32_t bins() const { return lists() * grid.bins(); }
    [[nodiscard]] size_t pixels(uint32_t eye) const { return size_t(eyes[eye].width) * eyes[eye].height; }
};

struct FrameBuffers { // device memory
    FrameCounters* counters;
    uint32_t *visible_groups, *visible, *histogram, *cells, *bin_class, *bin_queue;
    float *fraction, *scratch; // or null
    uint16_t* slab_of;
    unsigned char* splats;
    SplatPlace* places;
    BinKey* keys;
    Piece* pieces;
    ListSegment* segments;
    float* partial;
    unsigned char* scan_scratch;
    size_t scan_bytes;
    float *image[kMaxEyes], *transmittance[kMaxEyes];
};

// Lays a frame's buffers out.
FrameBuffers layOutFrame(ArenaLayout& layout, const DeviceScene& scene, const FrameShape& shape,
                         const FrameCapacity& capacity, const CudaLimits& limits);

// Everything the launches need. What a launch is given is copied.
struct FrameJob {
    const DeviceScene& scene;
    const FrameShape& shape;
    const FrameOptions& options;
    const FrameCapacity& capacity;
    const FrameBuffers& buffers;
    const CudaLimits& limits;
    const ReuseJob* reuse; // or null; where the shape keeps
    const CutArgs* cut;    // where the shape cuts
    OrderJob order;        // where the shape orders
};

// Asynchronous, in this order; decode to blend once per pass.
SelectCudaArgs selectArgs(const FrameJob& job);
StripSelectArgs stripSelectArgs(const FrameJob& job); // where the shape keeps, as the next two
ScheduleCudaArgs scheduleArgs(const FrameJob& job);
KeepCudaArgs keepArgs(const FrameJob& job);
SlabCudaArgs slabArgs(const FrameJob& job);
OrderCudaArgs orderArgs(const FrameJob& job); // where the shape orders; after the sort
void launchDecode(const FrameJob& job, uint32_t pass, const CudaStream& stream);
void launchBin(const FrameJob& job, uint32_t pass, const CudaStream& stream);
void launchSort(const FrameJob& job, const CudaStream& stream);
void launchBlend(const FrameJob& job, uint32_t pass, const CudaStream& stream);

} // namespace gsc
