// SPDX-License-Identifier: Apache-2.0
// How tests of reuse on a CPU draw.
#pragma once

#include "kernels/reuse/schedule.h"
#include "tests/kernels/reuse_scene.h"

#include <memory>

namespace gsc::test {

inline FrameOptions with(ReusePolicy policy, float bound = 0, uint32_t depth = 10)
{
    FrameOptions options;
    options.background[0] = 0.5f;
    options.reuse.policy = policy;
    options.reuse.bound = bound;
    options.reuse.max_depth = depth;
    return options;
}

inline std::unique_ptr<Renderer> open(const ModelView& model, int threads = 2)
{
    std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, threads);
    backend->load(model);
    return backend;
}

// One strip of small Gaussians that a camera has seen once, and then from elsewhere.
struct StepScene {
    std::vector<uint16_t> sensitivity = std::vector<uint16_t>(2 * kStripAnchors, 0x3c00); // 1
    SyntheticModel model{[] {
        SyntheticOptions options;
        options.anchors = kStripAnchors;
        options.log_scale = -8;
        options.extent = 0.3f;
        options.seed = 3;
        return options;
    }()};
    ModelView view = model.view();
    std::vector<EyeParams> before = walk(0, 1), after = walk(1, 1);

    StepScene() { view.sensitivity = sensitivity.data(); }

    // Predicted change of the strip, in 1/255.
    [[nodiscard]] float change() const
    {
        StripAnchors anchors;
        loadStripAnchors(view, view.sensitivity, view.groups[0], 0, anchors);
        return 255 * stripError(anchors, 0xffffu, before[0].center, after[0].center);
    }
    // Anchors that the second frame decodes where `bound` is allowed.
    uint64_t decoded(Renderer& backend, float bound) const
    {
        FrameOptions options;
        options.reuse.policy = ReusePolicy::Error;
        options.reuse.bound = bound;
        backend.load(view);
        for (int i = 0; i < 3; ++i) // a camera that stood still is on no way
            render(backend, before, options);
        return render(backend, after, options)[0].result.eyes[0].anchors_decoded;
    }
};

} // namespace gsc::test
