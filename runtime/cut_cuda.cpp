// SPDX-License-Identifier: Apache-2.0
#include "runtime/cut_cuda.h"

#include <algorithm>

namespace gsc {

void CudaCut::forget()
{
    for (CutPoses& poses : m_poses)
        poses.clear(); // begin() does the rest
}

void CudaCut::drop()
{
    forget();
    m_cache.release();
    m_args = {};
    m_groups = m_eyes = 0;
}

void CudaCut::prepare(uint32_t group_count, uint32_t eye_count)
{
    drop();
    layOutIn(m_cache, "the cut cache", [&](ArenaLayout& layout) {
        for (uint32_t e = 0; e < eye_count; ++e) {
            m_args.tables.outcomes[e] = layout.take<CutOutcome>(group_count);
            m_args.tables.lanes[e] = layout.take<CutLanes>(group_count);
        }
    });
    m_groups = group_count;
    m_eyes = eye_count;
}

void CudaCut::begin(const ModelParams& params, const EyeParams* eyes, uint32_t eye_count, const RasterConstants& rules,
                    float lod_bias, const CudaStream& stream)
{
    CutNow& now = m_args.now;
    for (uint32_t e = 0; e < eye_count; ++e) {
        CutPoses& poses = m_poses[e];
        const EyeClassifier classifier = eyeClassifier(params, eyes[e], rules, lod_bias);
        if (!poses.begin(eyes[e], classifier, rules, lod_bias)) // all bits set: no outcome
            GSC_CUDA_CHECK(
                cudaMemsetAsync(m_args.tables.outcomes[e], 0xff, m_groups * sizeof(CutOutcome), stream.handle));
        now.eyes[e] = poses.classifier();
        now.scales[e] = poses.scales();
        std::copy_n(poses.motions(), kCutPoses, now.motion[e]);
        now.pose[e] = poses.now();
    }
}

} // namespace gsc
