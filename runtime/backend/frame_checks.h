// SPDX-License-Identifier: Apache-2.0
// Checks of a model and of a frame that every renderer makes before it draws.
#pragma once

#include <gsc/renderer.h>

#include <string>

namespace gsc {

// All throw Error(Usage) for a fault that the caller can correct, InvalidFile or Unsupported otherwise.
void checkModel(const ModelView& model);
// `model` has no params before the first load. on_host: of the renderer.
void checkRequest(const ModelView& model, const FrameRequest& request, bool on_host);
void checkOptions(const ModelView& model, const FrameOptions& options, uint32_t eye_count);
void checkSize(uint32_t width, uint32_t height);                 // pixels
void checkColumns(const ColumnRange& columns, uint32_t width);   // columns of an image
void checkReuse(const std::string& backend, ReusePolicy policy); // Unsupported: a renderer of the backend has no such
// Throw Error(Internal) for a fault of the calling program: too many frames in flight, a ticket that is not in flight.
void checkInFlight(size_t frames, uint32_t most = kFramesInFlight);
[[noreturn]] void throwNotInFlight(uint64_t ticket);

// Bytes of a model's arrays as the stages read them.
uint64_t modelBytes(const ModelView& model);

// Colour of an image without Gaussians: black with upstream's quirk (trap 25), else the background, which a band of
// columns always has. FrameView::Cost shows no background.
inline const float* emptyColor(const FrameOptions& options)
{
    static constexpr float kBlack[3] = {0, 0, 0};
    return (options.empty_is_black && options.columns.all()) || options.view == FrameView::Cost ? kBlack
                                                                                                : options.background;
}

// True if both eyes are decoded at once, from the middle between their centres.
bool decodesMerged(const FrameOptions& options, uint32_t eye_count);
template <typename Eye, typename Real>
void mergedCenter(const Eye* eyes, Real* center)
{
    for (int i = 0; i < 3; ++i)
        center[i] = eyes[0].center[i] + (eyes[1].center[i] - eyes[0].center[i]) / 2;
}

} // namespace gsc
