// SPDX-License-Identifier: Apache-2.0
// Pictures of one frame, in the memory in which they are drawn and scored.
#pragma once

#include "player/frames/shots.h"
#include "runtime/metrics/picture_scorer.h"
#include "runtime/devices/device_pictures.h"

#include <memory>

namespace gsc {

struct FramePictures {
    FrameTarget::Kind kind = FrameTarget::Kind::Host; // or Device
    uint32_t width = 0, height = 0;
    std::shared_ptr<std::byte> eyes[kMaxEyes]; // height x width x 3 floats

    [[nodiscard]] FrameTarget target(size_t eye) const
    {
        FrameTarget target = hostTarget(reinterpret_cast<float*>(eyes[eye].get()));
        target.kind = kind;
        return target;
    }
    [[nodiscard]] PictureRef picture(size_t eye) const
    {
        return {reinterpret_cast<const float*>(eyes[eye].get()), width, height, kind == FrameTarget::Kind::Device};
    }
};

// Bytes of one eye's picture.
inline size_t pictureBytes(const Shot& shot)
{
    return size_t(shot.camera.width) * shot.camera.height * pixelBytes(PixelFormat::Rgb32f);
}

// Memory for a shot's pictures. Throws as PictureMemory::take() does.
inline FramePictures takePictures(PictureMemory& memory, const Shot& shot, uint32_t eye_count)
{
    FramePictures pictures{memory.kind(), shot.camera.width, shot.camera.height, {}};
    for (uint32_t e = 0; e < eye_count; ++e)
        pictures.eyes[e] = memory.take(pictureBytes(shot));
    return pictures;
}

} // namespace gsc
