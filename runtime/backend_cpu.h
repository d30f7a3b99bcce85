// SPDX-License-Identifier: Apache-2.0
// What the CPU backend offers beside the Backend interface: the frame in double precision, for tests and measuring.
#pragma once

#include "kernels/common/frame_types.h"

namespace gsc {

// Whole frame, scalar, flat, one thread, every operation in double. `images` as in Backend::render(). Slow on purpose.
void renderReference64(const ModelView& model, const EyeParams64* eyes, uint32_t eye_count, const FrameOptions& options,
                       double* const* images, FrameResult& result);

// The same in float: what CpuPath::Reference runs.
void renderReference32(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       float* const* images, FrameResult& result);

// This machine, used by `threads` threads.
struct DeviceFacts cpuFacts(uint32_t threads);

// Bytes of a model's arrays as the stages read them.
uint64_t modelBytes(const ModelView& model);

// Throws Error(Unsupported or Usage) for a model or options the CPU backend cannot render.
void checkModel(const ModelView& model);
void checkOptions(const ModelView& model, const FrameOptions& options, uint32_t eye_count);
void checkReuse(const ReuseOptions& reuse);
// Whether both eyes are decoded at once, and where from: the middle between their centres.
bool decodesMerged(const FrameOptions& options, uint32_t eye_count);
template <typename Eye, typename Real>
void mergedCenter(const Eye* eyes, Real* center)
{
    for (int i = 0; i < 3; ++i)
        center[i] = eyes[0].center[i] + (eyes[1].center[i] - eyes[0].center[i]) / 2;
}
// Throws Error(Unsupported) for one decode for both eyes beside reuse, which is not written for it.
void refuseMergedReuse(const FrameOptions& options, uint32_t eye_count);
// Throws Error(Unsupported) if Gaussians are to be kept between frames.
void refuseReuse(const ReuseOptions& reuse, const char* backend);
void checkSize(uint32_t width, uint32_t height);

} // namespace gsc
