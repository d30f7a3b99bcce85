// SPDX-License-Identifier: Apache-2.0
// Checks of a model and of a frame's request that every renderer makes before it draws.
#pragma once

#include <gsc/renderer.h>

#include <string>

namespace gsc {

// The checks throw Error(Usage) for a fault that the caller can correct, else InvalidFile or Unsupported.
void checkModel(const ModelView& model);
// Checks a frame's request. `model` has no params before the first load; `on_host`: the renderer draws on the host.
void checkRequest(const ModelView& model, const FrameRequest& request, bool on_host);
void checkOptions(const ModelView& model, const FrameOptions& options, uint32_t eye_count);
void checkSize(uint32_t width, uint32_t height);               // size of an eye's picture, pixels
void checkColumns(const ColumnRange& columns, uint32_t width); // checks that the columns lie in an image of this width
// throws Error(Unsupported) if the backend lacks this policy
void checkReuse(const std::string& backend, ReusePolicy policy);
// Both throw Error(Internal) for a fault of the calling program: too many frames in flight, or a ticket that is not in
// flight.
void checkInFlight(size_t frames, uint32_t most = kFramesInFlight);
[[noreturn]] void throwNotInFlight(uint64_t ticket);

// Bytes of a model's arrays in the form in which the stages read them.
uint64_t modelBytes(const ModelView& model);

// Colour of an image without Gaussians: the background, or black if the options ask for the trainers' behaviour
// (empty_is_black; never for a band of columns). FrameView::Cost is always on black.
inline const float* emptyColor(const FrameOptions& options)
{
    static constexpr float kBlack[3] = {0, 0, 0};
    return (options.empty_is_black && options.columns.all()) || options.view == FrameView::Cost ? kBlack
                                                                                                : options.background;
}

// Returns true if both eyes are decoded at once, as seen from the middle between their centres.
bool decodesMerged(const FrameOptions& options, uint32_t eye_count);
template <typename Eye, typename Real>
void mergedCenter(const Eye* eyes, Real* center)
{
    for (int i = 0; i < 3; ++i)
        center[i] = eyes[0].center[i] + (eyes[1].center[i] - eyes[0].center[i]) / 2;
}

} // namespace gsc
