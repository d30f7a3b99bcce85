// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/reuse_cuda.h"

#include "runtime/backend/frame_checks.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint64_t kShareOfMemory = 4; // entries take at most 1 / kShareOfMemory of the free bytes

uint32_t stripsOf(const ModelView& model)
{
    return uint32_t(model.params->group_count) * kStripsPerGroup;
}

// Most Gaussians of an entry, rounded up to whole warps.
uint32_t roomOf(const ModelView& model)
{
    return (kStripAnchors * model.params->n_offsets + 31) / 32 * 32;
}

uint64_t slotBytes(const ModelView& model)
{
    return sizeof(KeptEntry) + sizeof(uint32_t) + uint64_t(kKeptWords) * roomOf(model) * sizeof(KeptWord);
}

size_t clearedBytes(const ReuseTables& tables)
{
    return sizeof(ReuseCounters) + tables.slots * sizeof(uint32_t);
}

} // namespace

void CudaReuse::drop()
{
    m_cache.release();
    m_tables = {};
    m_now = {};
    m_limit = m_eyes = 0;
    m_forget = true;
}

bool CudaReuse::needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const
{
    return m_cache.bytes() == 0 || eye_count > m_eyes || reuse.cache_bytes != m_limit;
}

void CudaReuse::layOut(ArenaLayout& layout, ReuseTables& tables) const
{
    static_assert(sizeof(ReuseCounters) % sizeof(uint32_t) == 0);
    // one array, so that one memset clears it
    if (auto* const cleared = layout.take<unsigned char>(clearedBytes(tables)); cleared != nullptr) {
        tables.counters = reinterpret_cast<ReuseCounters*>(cleared);
        tables.claims = reinterpret_cast<uint32_t*>(cleared + sizeof(ReuseCounters));
    }
    tables.listed = layout.take<ListedStrip>(tables.strips);
    tables.wants = layout.take<Want>(size_t(kMaxEyes) * tables.strips);
    for (SeenStrip*& seen : tables.seen)
        seen = layout.take<SeenStrip>(tables.strips);
    tables.entries = layout.take<KeptEntry>(tables.slots);
    tables.words = layout.take<KeptWord>(size_t(tables.slots) * kKeptWords * tables.room);
}

void CudaReuse::prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count)
{
    const ModelView& model = scene.host();
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
    tables.slots = uint32_t(std::max<uint64_t>(std::min({most, limit / slotBytes(model), uint64_t(kNoEntry)}), 1));
    layOutIn(m_cache, "the cache of decoded Gaussians", [&](ArenaLayout& layout) { layOut(layout, tables); });
}

const ReuseNow& CudaReuse::begin(const FrameNow& frame, uint32_t eye_count, const FrameOptions& options,
                                 uint32_t flight, const CudaStream& stream)
{
    const ReuseOptions& reuse = options.reuse;
    ReuseNow& now = m_now;
    setNow(now, frame);
    // entries decoded for another appearance, or from another viewpoint, cannot be drawn in this frame
    const bool merged = decodesMerged(options, eye_count);
    m_again[flight] = false;
    if (m_forget || options.appearance != m_appearance || merged != (now.merged != 0)) {
        static_assert(kNoEntry == ~0u);
        GSC_CUDA_CHECK(cudaMemsetAsync(m_tables.entries, 0xff, m_tables.slots * sizeof(KeptEntry), stream.handle));
        for (SeenStrip* const seen : m_tables.seen) // marks all strips as not seen yet
            GSC_CUDA_CHECK(cudaMemsetAsync(seen, 0xff, m_tables.strips * sizeof(SeenStrip), stream.handle));
        now.frame = 0;
        m_forget = false;
    }
    m_appearance = options.appearance;
    ++now.frame;
    now.merged = merged ? 1 : 0;
    now.guidance = reuse.guidance;
    now.max_depth = reuse.max_depth;
    return now;
}

void CudaReuse::prepareFrame(FrameCapture& capture, const FrameJob&) const
{
    capture.clear(m_tables.counters, clearedBytes(m_tables));
}

void CudaReuse::listAnchors(FrameCapture& capture, const FrameJob& job) const
{
    capture.add(StripSelectArgs{selectArgs(job), m_tables, m_now.frame}, selectStripsCuda);
}

void CudaReuse::decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const
{
    const ScheduleCudaArgs schedule{m_now, job.buffers.counters, m_tables};
    capture.add(schedule, scheduleCuda);
    capture.add(schedule, claimCuda);
    const KeepCudaArgs keep{decodeArgs(job, pass), m_tables, job.shape.merged, m_now.frame};
    capture.add(keep, decodeKeepCuda);
    capture.add(keep, drawKeptCuda);
    if (job.shape.view == FrameView::Age)
        capture.add(PaintKeptArgs{paintArgs(job), m_tables, job.shape.merged, m_now.frame}, paintKeptCuda);
}

void CudaReuse::report(FrameCapture& capture, const FrameJob& job) const
{
    capture.copyToHost(m_pinned[job.flight].data, m_tables.counters, sizeof(ReuseCounters));
}

const ReuseNow& CudaReuse::beginAgain(uint32_t flight)
{
    m_again[flight] = true;
    return m_now;
}

void CudaReuse::skipFrame()
{
    ++m_now.frame;
}

void CudaReuse::addCounts(uint32_t flight, uint32_t eye_count, FrameResult& result)
{
    if (!m_again[flight])
        m_report = *m_pinned[flight].data;
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_decoded = m_report.decoded[e];
        result.eyes[e].anchors_reused = m_report.reused[e];
    }
    result.cache_evictions = m_report.evictions;
}

} // namespace gsc
