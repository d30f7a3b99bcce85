// SPDX-License-Identifier: Apache-2.0
// The renderers on the host, and the frame in double precision, for tests and measuring.
#pragma once

#include <gsc/renderer.h>

namespace gsc {

enum class CpuPath {
    Fast,      // SIMD, all threads
    Reference, // scalar float, one source with the kernels
};

// threads = 0 uses all cores. Needs nothing but the machine.
std::unique_ptr<Renderer> makeCpuRenderer(CpuPath path, int threads);

// Whole frame, scalar, flat, one thread, every operation in double. `images`: per eye height x width x 3 values,
// interleaved RGB, row 0 on top, unclamped; the array or an entry may be null. `depths`: per eye, or null. Slow on purpose.
void renderReference64(const ModelView& model, const EyeParams64* eyes, uint32_t eye_count, const FrameOptions& options,
                       double* const* images, FrameResult& result, const DepthRows<double>* depths = nullptr);

// renderReference64() in float: CpuPath::Reference runs it.
void renderReference32(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       float* const* images, FrameResult& result, const DepthRows<float>* depths = nullptr);

// This machine, used by `threads` threads.
DeviceFacts cpuFacts(uint32_t threads);

} // namespace gsc
