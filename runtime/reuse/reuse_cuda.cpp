// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/reuse_cuda.h"

#include "runtime/backend/frame_checks.h"
#include "runtime/model/model_sensitivity.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint64_t kShareOfMemory = 4; // entries take at most one in so many bytes that are free

uint32_t stripsOf(const ModelView& model)
{
    return uint32_t(model.params->group_count) * kStripsPerGroup;
}

// Gaussians of an entry at most, in whole warps.
uint32_t roomOf(const ModelView& model)
{
    return (kStripAnchors * model.params->n_offsets + 31) / 32 * 32;
}

uint64_t slotBytes(const ModelView& model)
{
    return sizeof(KeptEntry) + sizeof(uint32_t) + uint64_t(2) * kKeptWords * roomOf(model) * sizeof(KeptWord);
}

} // namespace

void CudaReuse::release()
{
    drop();
    m_sensitivity.release();
    m_view_sensitivity = nullptr;
}

void CudaReuse::drop()
{
    m_cache.release();
    m_tables = {};
    m_now = {};
    m_motion.forget();
    m_limit = m_eyes = 0;
    m_forget = true;
    m_policy = ReusePolicy::None;
}

bool CudaReuse::limitsDecoding(const ReuseOptions& reuse)
{
    return reuse.policy == ReusePolicy::Error && reuse.decode_budget > 0;
}

bool CudaReuse::needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const
{
    return m_cache.bytes() == 0 || eye_count > m_eyes || reuse.cache_bytes != m_limit ||
           (reuse.policy == ReusePolicy::Error && m_view_sensitivity == nullptr);
}

void CudaReuse::layOut(ArenaLayout& layout, ReuseTables& tables) const
{
    tables.scratch = layout.take<ReuseScratch>(1);
    tables.listed = layout.take<ListedStrip>(tables.strips);
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        tables.seen[e] = layout.take<SeenStrip>(tables.strips);
        tables.slot_of[e] = layout.take<uint32_t>(tables.strips);
    }
    tables.wants = layout.take<Want>(size_t(kMaxEyes) * tables.strips);
    tables.drawn = layout.take<DrawnSlots>(tables.strips);
    tables.decided = layout.take<DrawnSlots>(tables.strips);
    tables.decodes = layout.take<uint32_t>(size_t(kMaxEyes) * tables.strips);
    tables.entries = layout.take<KeptEntry>(tables.slots);
    tables.free_list = layout.take<uint32_t>(tables.slots);
    tables.words = layout.take<KeptWord>(size_t(tables.slots) * 2 * kKeptWords * tables.room);
}

void CudaReuse::prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count,
                        const CudaStream& stream)
{
    const ModelView& model = scene.host();
    if (reuse.policy == ReusePolicy::Error && m_view_sensitivity == nullptr) {
        const size_t anchors = scene.model().anchor_count;
        std::vector<uint16_t> computed;
        if (model.sensitivity == nullptr)
            computed = modelSensitivity(model, Workers(0));
        m_sensitivity.reserve(std::max<size_t>(anchors, 1) * sizeof(uint32_t), "the view sensitivities");
        GSC_CUDA_CHECK(cudaMemcpyAsync(m_sensitivity.get(), computed.empty() ? model.sensitivity : computed.data(),
                                       anchors * sizeof(uint32_t), cudaMemcpyHostToDevice, stream.handle));
        GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // the copy's source goes out of scope
        m_view_sensitivity = reinterpret_cast<const uint32_t*>(m_sensitivity.get());
    }
    const uint32_t eyes = std::max(eye_count, m_eyes);
    if (m_cache.bytes() != 0 && eyes == m_eyes && reuse.cache_bytes == m_limit)
        return;
    m_cache.release();
    m_forget = true;
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    m_limit = reuse.cache_bytes;
    m_eyes = eyes;
    ReuseTables& tables = m_tables;
    tables.strips = stripsOf(model);
    tables.room = roomOf(model);
    const uint64_t most = uint64_t(tables.strips) * eyes;
    const uint64_t limit = m_limit > 0 ? m_limit : m_cache.free(left) / kShareOfMemory;
    tables.slots = uint32_t(std::min<uint64_t>({most, limit / slotBytes(model), kNoEntry - 1}));
    m_ample = tables.slots == most;
    layOutIn(m_cache, "the cache of decoded Gaussians", [&](ArenaLayout& layout) { layOut(layout, tables); });
}

const ReuseNow& CudaReuse::begin(const FrameNow& frame, uint32_t eye_count, const FrameOptions& options,
                                 uint32_t flight, const CudaStream& stream)
{
    const ReuseOptions& reuse = options.reuse;
    ReuseNow& now = m_now;
    setNow(now, frame);
    // what was decoded for another row, or scheduled by another rule, is not what this frame would keep
    const bool merged = decodesMerged(options, eye_count);
    m_begun[flight] = {};
    if (m_forget || options.appearance != m_appearance || reuse.policy != m_policy || merged != (now.merged != 0)) {
        resetReuseCuda(m_tables, stream.handle);
        m_motion.forget();
        now.frame = 0;
        m_begun[flight].forgot = true;
        m_forget = false;
    }
    m_appearance = options.appearance;
    m_policy = reuse.policy;
    m_motion.follow(frame.eyes, eye_count);
    ++now.frame;
    now.again = 0;
    now.merged = merged ? 1 : 0;
    now.eye_count = eye_count;
    now.rule = reuseRule(reuse, m_motion.eyes(), kAnew);
    now.policy = reuse.policy;
    now.guidance = reuse.guidance;
    now.max_depth = reuse.max_depth;
    return now;
}

void CudaReuse::prepareFrame(FrameCapture& capture, const FrameJob& job) const
{
    const size_t used = !m_ample                    ? sizeof(ReuseScratch) // all of it counts what is scarce
                        : job.shape.limits_decoding ? offsetof(ReuseScratch, ages)
                                                    : offsetof(ReuseScratch, orders);
    capture.clear(&m_tables.scratch->counters, used - offsetof(ReuseScratch, counters));
}

void CudaReuse::listAnchors(FrameCapture& capture, const FrameJob& job) const
{
    capture.add(StripSelectArgs{selectArgs(job), m_tables, m_now.frame, m_now.policy == ReusePolicy::Depth},
                selectStripsCuda);
}

void CudaReuse::decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const
{
    const bool limited = job.shape.limits_decoding;
    const ScheduleCudaArgs schedule{
        m_now, job.scene.model().placement, m_view_sensitivity, job.buffers.counters, m_tables, m_ample};
    capture.add(schedule, scheduleCuda);
    if (!m_ample)
        capture.add(schedule, countAgesCuda);
    if (!m_ample || limited)
        capture.add(schedule, reuseLevelsCuda);
    if (limited) {
        capture.add(schedule, countSplitsCuda);
        capture.add(schedule, splitLevelsCuda);
    }
    if (!m_ample)
        capture.add(schedule, evictCuda);
    capture.add(schedule, grantCuda);
    const KeepCudaArgs keep{decodeArgs(job, pass), m_tables, job.shape.merged};
    capture.add(keep, decodeKeepCuda);
    capture.add(keep, drawKeptCuda);
    if (job.shape.view == FrameView::Age)
        capture.add(PaintKeptArgs{paintArgs(job), m_tables, m_now.frame}, paintKeptCuda);
}

void CudaReuse::report(FrameCapture& capture, const FrameJob& job) const
{
    capture.copyToHost(m_pinned[job.flight].data, m_tables.scratch, sizeof(ReuseReport));
}

const ReuseNow& CudaReuse::beginAgain(uint32_t flight)
{
    m_begun[flight] = {false, true};
    m_now.again = 1;
    return m_now;
}

void CudaReuse::skipFrame()
{
    ++m_now.frame;
    m_motion.forget();
}

void CudaReuse::addCounts(uint32_t flight, uint32_t eye_count, bool overflowed, FrameResult& result)
{
    if (!m_begun[flight].again)
        m_report = *m_pinned[flight].data;
    if (m_begun[flight].forgot || m_report.state.evictions < m_evictions) // or the frame that forgot was not counted
        m_evictions = 0;
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_decoded = m_report.counters.decoded[e];
        result.eyes[e].anchors_reused = m_report.counters.reused[e];
        result.eyes[e].anchors_overdue = m_report.counters.overdue[e];
    }
    result.cache_evictions = m_report.state.evictions - m_evictions;
    if (!overflowed)
        m_evictions = m_report.state.evictions;
}

} // namespace gsc
