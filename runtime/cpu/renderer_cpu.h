// SPDX-License-Identifier: Apache-2.0
// The renderers on the host, and a frame in double precision for tests and measurements.
#pragma once

#include <gsc/renderer.h>

namespace gsc {

enum class CpuPath {
    Fast,      // fast CPU version: SIMD, on all threads
    Reference, // reference: scalar float, compiled from the same source as the kernels
};

// Makes a renderer on the host. threads = 0 uses all cores.
std::unique_ptr<Renderer> makeCpuRenderer(CpuPath path, int threads);

// Draws a whole frame in double precision: scalar, in one thread, slow on purpose. `images` has for each eye height x
// width x 3 values: RGB interleaved, row 0 on top, not clamped; the array or an entry may be null. `depths` has an
// array for each eye, or is null.
void renderReference64(const ModelView& model, const EyeParams64* eyes, uint32_t eye_count, const FrameOptions& options,
                       double* const* images, FrameResult& result, const DepthRows<double>* depths = nullptr);

// Does as renderReference64(), in float. CpuPath::Reference runs it.
void renderReference32(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       float* const* images, FrameResult& result, const DepthRows<float>* depths = nullptr);

// Returns the facts of this machine when `threads` threads draw.
DeviceFacts cpuFacts(uint32_t threads);

} // namespace gsc
