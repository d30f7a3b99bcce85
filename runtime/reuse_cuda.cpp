// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse_cuda.h"

#include "runtime/model_sensitivity.h"

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

CudaReuse::CudaReuse(MemoryBudget& budget) : m_cache(budget), m_sensitivity(budget)
{
    GSC_CUDA_CHECK(cudaMallocHost(reinterpret_cast<void**>(&m_job.report), sizeof(ReuseReport)));
}

CudaReuse::~CudaReuse()
{
    cudaFreeHost(m_job.report);
}

void CudaReuse::release()
{
    drop();
    m_sensitivity.release();
    m_job.sensitivity = nullptr;
}

void CudaReuse::drop()
{
    m_cache.release();
    m_job.tables = {};
    m_job.now = {};
    m_motion.forget();
    m_limit = m_eyes = 0;
    m_forget = true;
    m_policy = ReusePolicy::None;
}

bool CudaReuse::budgeted(const ReuseOptions& reuse)
{
    return reuse.policy == ReusePolicy::Error && reuse.decode_budget > 0;
}

bool CudaReuse::needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const
{
    return m_cache.bytes() == 0 || eye_count > m_eyes || reuse.cache_bytes != m_limit ||
           (reuse.policy == ReusePolicy::Error && m_job.sensitivity == nullptr);
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
    if (reuse.policy == ReusePolicy::Error && m_job.sensitivity == nullptr) {
        const size_t anchors = scene.model().anchor_count;
        std::vector<uint16_t> computed;
        if (model.sensitivity == nullptr)
            computed = modelSensitivity(model, Workers(0));
        m_sensitivity.reserve(std::max<size_t>(anchors, 1) * sizeof(uint32_t), "the view sensitivities");
        GSC_CUDA_CHECK(cudaMemcpyAsync(m_sensitivity.get(), computed.empty() ? model.sensitivity : computed.data(),
                                       anchors * sizeof(uint32_t), cudaMemcpyHostToDevice, stream.handle));
        GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // the copy's source goes out of scope
        m_job.sensitivity = reinterpret_cast<const uint32_t*>(m_sensitivity.get());
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
    ReuseTables& tables = m_job.tables;
    tables.strips = stripsOf(model);
    tables.room = roomOf(model);
    const uint64_t most = uint64_t(tables.strips) * eyes;
    const uint64_t limit = m_limit > 0 ? m_limit : m_cache.free(left) / kShareOfMemory;
    tables.slots = uint32_t(std::min<uint64_t>({most, limit / slotBytes(model), kNoEntry - 1}));
    m_job.ample = tables.slots == most;
    layOutIn(m_cache, "the cache of decoded Gaussians", [&](ArenaLayout& layout) { layOut(layout, tables); });
}

void CudaReuse::begin(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, const CudaStream& stream)
{
    const ReuseOptions& reuse = options.reuse;
    ReuseNow& now = m_job.now;
    // what was decoded for another row, or scheduled by another rule, is not what this frame would keep
    if (m_forget || options.appearance != m_appearance || reuse.policy != m_policy) {
        resetReuseCuda(m_job.tables, stream.handle);
        m_motion.forget();
        now.frame = 0;
        m_evictions = 0;
        m_forget = false;
    }
    m_appearance = options.appearance;
    m_policy = reuse.policy;
    m_motion.follow(eyes, eye_count);
    ++now.frame;
    now.again = 0;
    now.eye_count = eye_count;
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        std::copy_n(m_motion.center(e), 3, now.center[e]);
        std::copy_n(m_motion.step(e), 3, now.step[e]);
        now.steady[e] = m_motion.steady(e) ? 1 : 0;
        now.erratic[e] = m_motion.erratic(e) ? 1 : 0;
        now.history[e] = m_motion.history(e);
    }
    now.policy = reuse.policy;
    now.guidance = reuse.guidance;
    now.max_depth = reuse.max_depth;
    now.bound = reuse.bound / 255.0f;
    now.decode_budget = budgeted(reuse) ? reuse.decode_budget : 0;
}

void CudaReuse::endTry()
{
    if (m_job.now.again == 0)
        m_report = *m_job.report;
    m_job.now.again = 1;
}

void CudaReuse::skipFrame()
{
    ++m_job.now.frame;
    m_motion.forget();
}

void CudaReuse::addCounts(uint32_t eye_count, FrameResult& result)
{
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_decoded = m_report.counters.decoded[e];
        result.eyes[e].anchors_reused = m_report.counters.reused[e];
        result.eyes[e].anchors_overdue = m_report.counters.overdue[e];
    }
    result.cache_evictions = m_report.state.evictions - m_evictions;
    m_evictions = m_report.state.evictions;
}

} // namespace gsc
