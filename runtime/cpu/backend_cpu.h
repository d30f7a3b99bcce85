// SPDX-License-Identifier: Apache-2.0
// What the CPU backend offers beside the Backend interface: the frame in double precision, for tests and measuring.
#pragma once

#include "kernels/frame/frame_types.h"

namespace gsc {

// Whole frame, scalar, flat, one thread, every operation in double. `images` as in Backend::render(). Slow on purpose.
void renderReference64(const ModelView& model, const EyeParams64* eyes, uint32_t eye_count, const FrameOptions& options,
                       double* const* images, FrameResult& result);

// The same in float: what CpuPath::Reference runs.
void renderReference32(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       float* const* images, FrameResult& result);

// This machine, used by `threads` threads.
struct DeviceFacts cpuFacts(uint32_t threads);

} // namespace gsc
