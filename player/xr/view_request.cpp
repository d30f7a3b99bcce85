// SPDX-License-Identifier: Apache-2.0
#include "player/xr/view_request.h"

#include <algorithm>

namespace gsc {

void requestViews(AskedViews& views, const Shot& lens, const Placement& place, const HeadsetFacts& facts,
                  const ViewLenses& lenses, const SpacePose* gaze, const std::shared_ptr<LateEyes>& late)
{
    views.metre = place.scale();
    const std::vector<HeadsetView>& sizes = facts.views;
    const auto camera = [&](size_t view) {
        Camera eye = lens.camera;
        eye.width = sizes[view].width;
        eye.height = sizes[view].height;
        return place.eye(views.eyes[view], eye);
    };
    if (late)
        views.late = std::make_shared<LateLook>();
    for (size_t view = 0; view < views.eyes.size(); view += kMaxEyes) {
        AskedPose& pair = views.pairs.emplace_back();
        pair.shot = lens;
        pair.shot.camera = camera(view);
        pair.shot.ipd = 0;
        pair.shot.right_eye.reset();
        pair.eyes = 1;
        pair.format = facts.pixels;
        pair.wants_depth = facts.takes_depth;
        if (view + 1 < views.eyes.size()) {
            pair.shot.right_eye = camera(view + 1);
            pair.eyes = 2;
        }
        if (late)
            pair.late = [late, look = views.late, place, view, asked = views.eyes](Shot& shot) {
                if (!late->find(*look, asked))
                    return false;
                shot.camera = place.eye(look->eyes[view], shot.camera);
                if (shot.right_eye)
                    shot.right_eye = place.eye(look->eyes[view + 1], *shot.right_eye);
                return true;
            };
        for (size_t e = 0; e < pair.eyes; ++e)
            pair.lens[e] = lenses.of(view + e);
        for (size_t e = 0; gaze != nullptr && e < pair.eyes; ++e) {
            const std::array<float, 2> at = gazeOf(views.eyes[view + e], *gaze);
            std::ranges::copy(at, pair.gaze[e]);
            views.gaze.push_back(at);
        }
    }
}

} // namespace gsc
