// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/coarse/coarse_cuda.h"

#include "kernels/math/lod.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint64_t kShareOfMemory = 6; // copies take at most 1 / kShareOfMemory of the free bytes
// Memory for copies of all groups, as a share of the Gaussians that the model can have: a copy of a far group has less
// than a third of the group's Gaussians, of which only seven in ten are kept by their opacity.
constexpr double kKeptShare = 0.3;
// Most copies made in a frame: number of groups / kBudgetShare + kLeastBudget.
constexpr uint32_t kBudgetShare = 8, kLeastBudget = 512;

} // namespace

void CudaCoarse::loadKernels(const DeviceScene& scene) const
{
    loadCoarseSchedule(decidesAtOnce(scene));
    loadCoarseMake(scene.model().compact_shape != nullptr, scene.bank() != nullptr);
    loadCoarseDraw();
}

void CudaCoarse::release()
{
    m_arena.release();
    m_tables = {};
    m_now = {};
    m_forget = true;
}

void CudaCoarse::prepare(const DeviceScene& scene, uint64_t others)
{
    const DeviceModel& model = scene.model();
    m_forget = true;
    m_levels = levelsSwitch(model.params);
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    m_tables.group_count = uint32_t(model.params.group_count);
    const double gaussians = double(model.anchor_count) * model.params.n_offsets;
    const uint64_t all =
        uint64_t(gaussians * kKeptShare / kPageGaussians) + uint64_t(m_tables.group_count) + kMostPages;
    const uint64_t room = (m_arena.free(left) - std::min(m_arena.free(left), others)) / kShareOfMemory /
                          (sizeof(CoarsePage) + 2 * sizeof(uint32_t));
    m_tables.page_count = uint32_t(std::min<uint64_t>({all, room, kNoPage / 2}));
    layOutIn(m_arena, "coarse copies", [&](ArenaLayout& layout) {
        const size_t groups = m_tables.group_count;
        m_tables.buckets = layout.take<CoarseBuckets>(1);
        m_tables.free = layout.take<CoarseRing>(1);
        m_tables.groups = layout.take<CoarseGroup>(groups);
        m_tables.near = layout.take<uint32_t>(groups);
        m_tables.drawn = layout.take<uint32_t>(groups);
        m_tables.wants = layout.take<uint32_t>(groups);
        m_tables.urgency = layout.take<uint32_t>(groups);
        m_tables.page_of = layout.take<uint32_t>(groups * kMostPages);
        m_tables.ring = layout.take<uint32_t>(size_t(2) * m_tables.page_count);
        m_tables.pages = layout.take<CoarsePage>(m_tables.page_count);
    });
}

const CoarseNow& CudaCoarse::begin(const FrameNow& frame, uint32_t eye_count, const FrameOptions& options, bool repeats,
                                   uint32_t processors, const CudaStream& stream)
{
    setNow(m_now, frame);
    const bool changed = options.appearance != m_appearance || options.lod_fade != m_lod_fade;
    const bool forgets = m_forget || (changed && m_any);
    if (forgets) {
        resetCoarseCuda(m_tables, processors, stream.handle);
        m_now.frame = 0;
        m_any = false;
    }
    // Frames that each have an appearance row of their own make no copies, because no later frame would draw them.
    const bool makes = m_forget || !changed;
    m_any = m_any || makes;
    m_forget = false;
    m_appearance = options.appearance;
    m_lod_fade = options.lod_fade;
    m_now.view = coarseView(frame.eyes, frame.level_eyes, eye_count, options.detail, options.lod_bias, m_levels);
    if (frame.finest > 0)
        foveate(frame.eyes, eye_count, frame.gaze, frame.finest, m_now.view);
    m_now.budget = !makes ? 0 : m_unlimited ? m_tables.group_count : m_tables.group_count / kBudgetShare + kLeastBudget;
    m_now.again = repeats && !forgets ? 1 : 0;
    m_now.frame += m_now.again == 0 ? 1 : 0;
    return m_now;
}

const CoarseNow& CudaCoarse::beginAgain()
{
    m_now.again = 1;
    return m_now;
}

CoarseCudaArgs CudaCoarse::cudaArgs(const FrameJob& job, uint32_t pass) const
{
    return {decodeArgs(job, pass), m_tables, m_now.view, m_now.frame, job.buffers.histogram};
}

void CudaCoarse::listAnchors(FrameCapture& capture, const FrameJob& job) const
{
    const CoarseScheduleArgs schedule{m_now,
                                      job.scene.model(),
                                      job.shape.eye_count,
                                      job.shape.rules,
                                      job.buffers.visible_groups,
                                      job.buffers.histogram,
                                      job.buffers.counters,
                                      m_tables};
    if (decidesAtOnce(job.scene)) {
        capture.add(schedule, coarseDecideCuda);
    } else {
        capture.add(schedule, coarseScheduleCuda);
        capture.add(schedule, coarseGrantCuda);
        capture.add(schedule, coarseEvictCuda);
        capture.add(schedule, coarseListCuda);
    }
    capture.add(cudaArgs(job, 0), coarseMakeCuda);
    SelectCudaArgs select = selectArgs(job);
    select.listed_groups = m_tables.near;
    select.group_count = &job.buffers.counters->coarse.near;
    capture.add(select, selectAnchorsCuda);
}

void CudaCoarse::decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const
{
    decodeFrame(capture, job, pass);
    capture.add(cudaArgs(job, pass), coarseDrawCuda);
    const bool ages = job.shape.view == FrameView::Age;
    if (ages || job.shape.view == FrameView::Detail)
        capture.add(PaintCoarseArgs{paintArgs(job), m_tables, m_now.view, m_now.frame, ages}, paintCoarseCuda);
}

void addCoarseCounts(const CoarseCounters& c, uint32_t eye_count, FrameResult& result)
{
    result.coarse = {c.groups_near, c.groups_kept, c.groups_stale, c.groups_made};
    const uint32_t copied = c.anchors_made + c.anchors_kept + c.anchors_stale;
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_visible += copied;
        result.eyes[e].anchors_reused += c.anchors_kept + c.anchors_stale;
        result.eyes[e].anchors_overdue += c.anchors_stale;
    }
    result.eyes[0].anchors_decoded += c.anchors_made;
}

} // namespace gsc
