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
// Throws Error(Unsupported) if Gaussians or an order are to be kept between frames.
void refuseReuse(const ReuseOptions& reuse, const char* backend);
void checkSize(uint32_t width, uint32_t height);

} // namespace gsc
