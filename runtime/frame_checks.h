// SPDX-License-Identifier: Apache-2.0
// What every backend asks of a model and of a frame before it draws.
#pragma once

#include "kernels/frame/frame_types.h"

namespace gsc {

// All throw Error(Usage) for what the caller can correct, InvalidFile or Unsupported for what it cannot.
void checkModel(const ModelView& model);
void checkOptions(const ModelView& model, const FrameOptions& options, uint32_t eye_count);
void checkReuse(const ReuseOptions& reuse);
void checkSize(uint32_t width, uint32_t height); // pixels
// One decode for both eyes beside ReusePolicy::Error, whose bound is of what each eye sees.
void refuseMergedReuse(const FrameOptions& options, uint32_t eye_count);
// Gaussians kept between frames, where `backend` keeps none.
void refuseReuse(const ReuseOptions& reuse, const char* backend);

// Bytes of a model's arrays as the stages read them.
uint64_t modelBytes(const ModelView& model);

// Whether both eyes are decoded at once, and where from: the middle between their centres.
bool decodesMerged(const FrameOptions& options, uint32_t eye_count);
template <typename Eye, typename Real>
void mergedCenter(const Eye* eyes, Real* center)
{
    for (int i = 0; i < 3; ++i)
        center[i] = eyes[0].center[i] + (eyes[1].center[i] - eyes[0].center[i]) / 2;
}

} // namespace gsc
