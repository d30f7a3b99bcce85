// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame_graph.h"

#include "kernels/decode/decode_exact_cuda.h"
#include "kernels/select/select_cuda.h"
#include "runtime/backend_cpu.h"

#include <algorithm>
#include <cstddef>

namespace gsc {

namespace {

void mark(const CudaEvent& event, const CudaStream& stream)
{
    // external: a node that records it in every launch, not a dependency of the capture
    GSC_CUDA_CHECK(cudaEventRecordWithFlags(event.handle, stream.handle, cudaEventRecordExternal));
}

// `change` takes the arguments of the node's kernel.
template <typename Args, typename Change>
void setArgs(cudaGraphExec_t exec, cudaGraphNode_t node, const Change& change)
{
    cudaKernelNodeParams params{};
    GSC_CUDA_CHECK(cudaGraphKernelNodeGetParams(node, &params));
    Args args = *static_cast<const Args*>(params.kernelParams[0]);
    change(args);
    void* list[] = {&args};
    params.kernelParams = list;
    params.extra = nullptr;
    GSC_CUDA_CHECK(cudaGraphExecKernelNodeSetParams(exec, node, &params));
}

bool sameRules(const RasterConstants& a, const RasterConstants& b)
{
    return a.gsplat == b.gsplat && a.near_z == b.near_z;
}

} // namespace

FrameGraph::FrameGraph(const FrameJob& job, FrameCounters* counters, const CudaStream& stream)
    : m_shape(job.shape), m_options(job.options), m_capacity(job.capacity)
{
    for (uint32_t p = 0; p < m_shape.passes; ++p)
        m_passes.push_back(std::make_unique<PassEvents>());
    GSC_CUDA_CHECK(cudaStreamBeginCapture(stream.handle, cudaStreamCaptureModeThreadLocal));
    try {
        capture(job, counters, stream);
    } catch (...) {
        (void)cudaStreamEndCapture(stream.handle, &m_graph);
        (void)cudaGetLastError(); // that the capture is broken is known, and must not show up at the next launch
        if (m_graph != nullptr)
            cudaGraphDestroy(m_graph);
        throw;
    }
    GSC_CUDA_CHECK(cudaStreamEndCapture(stream.handle, &m_graph));
    const cudaError_t code = cudaGraphInstantiate(&m_exec, m_graph, 0);
    if (code != cudaSuccess) {
        cudaGraphDestroy(m_graph);
        throwCuda(code, "cudaGraphInstantiate(");
    }
}

FrameGraph::~FrameGraph()
{
    cudaGraphExecDestroy(m_exec);
    cudaGraphDestroy(m_graph);
}

// The node captured last is one whose arguments hold the eyes.
void FrameGraph::noteEyes(const CudaStream& stream, Takes takes)
{
    cudaStreamCaptureStatus status{};
    const cudaGraphNode_t* nodes = nullptr;
    size_t count = 0;
#if CUDART_VERSION >= 13000
    GSC_CUDA_CHECK(cudaStreamGetCaptureInfo(stream.handle, &status, nullptr, nullptr, &nodes, nullptr, &count));
#else
    GSC_CUDA_CHECK(cudaStreamGetCaptureInfo(stream.handle, &status, nullptr, nullptr, &nodes, &count));
#endif
    m_eye_nodes.push_back({nodes[count - 1], takes});
}

void FrameGraph::captureSelect(const FrameJob& job, const CudaStream& stream)
{
    const uint32_t processors = job.limits.processors;
    if (job.shape.keeps) {
        const bool all = !job.reuse->ample; // of what is counted only so that something can be scarce
        const size_t used = all                  ? sizeof(ReuseScratch)
                            : job.shape.budgeted ? offsetof(ReuseScratch, ages)
                                                 : offsetof(ReuseScratch, orders);
        GSC_CUDA_CHECK(cudaMemsetAsync(&job.reuse->tables.scratch->counters, 0, used - offsetof(ReuseScratch, counters),
                                       stream.handle));
    }
    if (job.shape.cuts)
        return captureCut(job, stream);
    selectGroupsCuda(selectArgs(job), processors, stream.handle);
    noteEyes(stream, Takes::Select);
    if (job.shape.keeps)
        selectStripsCuda(stripSelectArgs(job), processors, stream.handle);
    else
        selectAnchorsCuda(selectArgs(job), processors, stream.handle);
    noteEyes(stream, job.shape.keeps ? Takes::Strips : Takes::Select);
}

// Selection with the cut cache.
void FrameGraph::captureCut(const FrameJob& job, const CudaStream& stream)
{
    const uint32_t processors = job.limits.processors;
    const WithCut<SelectCudaArgs> select{selectArgs(job), *job.cut};
    selectGroupsCuda(select, processors, stream.handle);
    noteEyes(stream, Takes::CutSelect);
    if (job.shape.keeps) {
        const WithCut<StripSelectArgs> strips{stripSelectArgs(job), *job.cut};
        selectStripsCuda(strips, processors, stream.handle);
        noteEyes(stream, Takes::CutStrips);
        selectKnownCuda(strips, processors, stream.handle);
        noteEyes(stream, Takes::CutStrips);
    } else {
        selectAnchorsCuda(select, processors, stream.handle);
        noteEyes(stream, Takes::CutSelect);
        selectKnownCuda(select, processors, stream.handle);
        noteEyes(stream, Takes::CutSelect);
    }
}

void FrameGraph::capture(const FrameJob& job, FrameCounters* counters, const CudaStream& stream)
{
    const auto clear = [&](void* data, size_t bytes) {
        GSC_CUDA_CHECK(cudaMemsetAsync(data, 0, bytes, stream.handle));
    };
    mark(m_start, stream);
    clear(job.buffers.counters, sizeof(FrameCounters));
    clear(job.buffers.histogram, kDepthBuckets * sizeof(uint32_t));
    captureSelect(job, stream);
    slabCuda(slabArgs(job), stream.handle);
    if (job.shape.orders)
        noteEyes(stream, Takes::Slab);
    mark(m_selected, stream);
    for (uint32_t p = 0; p < job.shape.passes; ++p) {
        if (p > 0)
            clear(&job.buffers.counters->pass, sizeof(PassCounters));
        clear(job.buffers.cells, job.shape.cells() * sizeof(uint32_t));
        if (job.shape.keeps) {
            captureReuse(job, stream);
        } else {
            launchDecode(job, p, stream);
            noteEyes(stream, job.shape.exact ? Takes::DecodeExact : Takes::DecodeFast);
        }
        mark(m_passes[p]->decoded, stream);
        launchBin(job, p, stream);
        mark(m_passes[p]->binned, stream);
        launchSort(job, stream);
        if (job.shape.orders) {
            noteOrderCuda(orderArgs(job), stream.handle);
            noteEyes(stream, Takes::Order);
        }
        mark(m_passes[p]->sorted, stream);
        launchBlend(job, p, stream);
        mark(m_passes[p]->blended, stream);
    }
    GSC_CUDA_CHECK(
        cudaMemcpyAsync(counters, job.buffers.counters, sizeof(FrameCounters), cudaMemcpyDeviceToHost, stream.handle));
    if (job.shape.keeps)
        GSC_CUDA_CHECK(cudaMemcpyAsync(job.reuse->report, job.reuse->tables.scratch, sizeof(ReuseReport),
                                       cudaMemcpyDeviceToHost, stream.handle));
}

// Decode of a frame that may draw what earlier frames decoded.
void FrameGraph::captureReuse(const FrameJob& job, const CudaStream& stream)
{
    const uint32_t processors = job.limits.processors;
    const ScheduleCudaArgs schedule = scheduleArgs(job);
    scheduleCuda(schedule, processors, stream.handle);
    noteEyes(stream, Takes::Schedule);
    if (!schedule.ample) {
        countAgesCuda(schedule, processors, stream.handle);
        noteEyes(stream, Takes::Schedule);
    }
    if (!schedule.ample || job.shape.budgeted) {
        reuseLevelsCuda(schedule, stream.handle);
        noteEyes(stream, Takes::Schedule);
    }
    if (job.shape.budgeted) {
        countSplitsCuda(schedule, processors, stream.handle);
        noteEyes(stream, Takes::Schedule);
        splitLevelsCuda(schedule, stream.handle);
        noteEyes(stream, Takes::Schedule);
    }
    if (!schedule.ample) {
        evictCuda(schedule, processors, stream.handle);
        noteEyes(stream, Takes::Schedule);
    }
    grantCuda(schedule, processors, stream.handle);
    noteEyes(stream, Takes::Schedule);
    const KeepCudaArgs keep = keepArgs(job);
    decodeKeepCuda(keep, processors, stream.handle);
    noteEyes(stream, Takes::Keep);
    drawKeptCuda(keep, processors, stream.handle);
    noteEyes(stream, Takes::Keep);
}

bool FrameGraph::fits(const FrameJob& job) const
{
    const FrameShape &a = m_shape, &b = job.shape;
    if (a.eye_count != b.eye_count || a.passes != b.passes || a.exact != b.exact || a.fades != b.fades ||
        a.merged != b.merged || a.keeps != b.keeps || a.budgeted != b.budgeted || a.cuts != b.cuts ||
        a.orders != b.orders || a.shared_bins != b.shared_bins || !(a.grid == b.grid) || !sameRules(a.rules, b.rules) ||
        !(m_capacity == job.capacity))
        return false;
    for (uint32_t e = 0; e < a.eye_count; ++e)
        if (a.eyes[e].width != b.eyes[e].width || a.eyes[e].height != b.eyes[e].height)
            return false;
    return std::equal(m_options.background, m_options.background + 3, job.options.background) &&
           m_options.appearance == job.options.appearance && m_options.empty_is_black == job.options.empty_is_black;
}

void FrameGraph::launch(const EyeParams* eyes, const EyeParams* chosen, const FrameOptions& options,
                        const ReuseJob* reuse, const CutArgs* cut, const OrderJob& order, const CudaStream& stream)
{
    const auto select = [&](SelectCudaArgs& args) {
        std::copy_n(chosen, args.eye_count, args.eyes);
        args.lod_bias = options.lod_bias; // that of a frame that holds its time changes all the time
        args.lod_fade = options.lod_fade;
    };
    const auto strips = [&](StripSelectArgs& args) {
        select(args);
        args.frame = reuse->now.frame;
        args.counts_fresh = reuse->now.policy == ReusePolicy::Depth;
    };
    const auto decode = [&](auto& args) {
        std::copy_n(eyes, args.eye_count, args.eyes);
        if (args.merged)
            mergedCenter(eyes, args.look_from);
    };
    for (const EyeNode& n : m_eye_nodes)
        switch (n.takes) {
        case Takes::Select:
            setArgs<SelectCudaArgs>(m_exec, n.node, select);
            break;
        case Takes::Strips:
            setArgs<StripSelectArgs>(m_exec, n.node, strips);
            break;
        case Takes::CutSelect:
            setArgs<WithCut<SelectCudaArgs>>(m_exec, n.node, [&](auto& args) {
                select(args);
                args.cut = *cut;
            });
            break;
        case Takes::CutStrips:
            setArgs<WithCut<StripSelectArgs>>(m_exec, n.node, [&](auto& args) {
                strips(args);
                args.cut = *cut;
            });
            break;
        case Takes::Slab:
            setArgs<SlabCudaArgs>(m_exec, n.node, [&](SlabCudaArgs& args) {
                args.known = order.known;
                args.next = order.next;
            });
            break;
        case Takes::Order:
            setArgs<OrderCudaArgs>(m_exec, n.node, [&](OrderCudaArgs& args) { args.next = order.next; });
            break;
        case Takes::Schedule:
            setArgs<ScheduleCudaArgs>(m_exec, n.node, [&](ScheduleCudaArgs& args) {
                args.sensitivity = reuse->sensitivity;
                args.now = reuse->now;
            });
            break;
        case Takes::Keep:
            setArgs<KeepCudaArgs>(m_exec, n.node,
                                  [&](KeepCudaArgs& args) { std::copy_n(eyes, args.eye_count, args.eyes); });
            break;
        case Takes::DecodeFast:
            setArgs<DecodeCudaArgs>(m_exec, n.node, decode);
            break;
        case Takes::DecodeExact:
            setArgs<DecodeExactArgs>(m_exec, n.node, decode);
            break;
        }
    GSC_CUDA_CHECK(cudaGraphLaunch(m_exec, stream.handle));
}

StageTimes FrameGraph::times() const
{
    StageTimes times;
    times.select = m_selected.since(m_start);
    const CudaEvent* previous = &m_selected;
    for (const std::unique_ptr<PassEvents>& pass : m_passes) {
        times.decode += pass->decoded.since(*previous);
        times.bin += pass->binned.since(pass->decoded);
        times.sort += pass->sorted.since(pass->binned);
        times.blend += pass->blended.since(pass->sorted);
        previous = &pass->blended;
    }
    times.total = previous->since(m_start);
    return times;
}

} // namespace gsc
