// SPDX-License-Identifier: Apache-2.0
#include "runtime/frames/shot.h"

#include "runtime/cameras/scene_cameras.h"

#include <algorithm>
#include <iterator>

namespace gsc {

Shot shotOf(const Scene& scene, const Camera& camera)
{
    Shot shot{camera, 0, appearanceFor(scene, camera), 0, std::nullopt};
    std::copy_n(scene.view().origin, 3, shot.origin);
    return shot;
}

void shotEyes(const Shot& shot, uint32_t eye_count, EyeParams* eyes)
{
    if (eye_count == 1) {
        eyes[0] = eyeParams(shot.camera, shot.origin);
        return;
    }
    if (shot.right_eye) {
        eyes[0] = eyeParams(shot.camera, shot.origin);
        eyes[1] = eyeParams(*shot.right_eye, shot.origin);
        return;
    }
    Camera left, right;
    stereoPair(shot.camera, shot.ipd, left, right);
    eyes[0] = eyeParams(left, shot.origin);
    eyes[1] = eyeParams(right, shot.origin);
}

int32_t shotAppearance(const Scene& scene, const Shot& shot)
{
    return shot.appearance < 0 ? -1 : scene.appearanceRow(shot.appearance);
}

FrameOptions modelOptions(const Scene& scene)
{
    FrameOptions options;
    if (scene.view().params->flags & kModelWhiteBackground)
        std::fill(std::begin(options.background), std::end(options.background), 1.0f);
    return options;
}

FrameOptions exactOptions(FrameOptions frame)
{
    frame.tier = Tier::Exact;
    frame.stereo = StereoMode::Exact;
    frame.lod_bias = frame.lod_fade = frame.lod_hysteresis = 0;
    frame.reuse = {};
    frame.foveation = {};
    frame.detail = 0;
    return frame;
}

FrameOptions exactOptionsFor(const Scene& scene, const Camera& camera)
{
    FrameOptions options = exactOptions(modelOptions(scene));
    options.appearance = shotAppearance(scene, shotOf(scene, camera));
    return options;
}

} // namespace gsc
