// SPDX-License-Identifier: Apache-2.0
// How tests of reuse on a CPU draw.
#pragma once

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

} // namespace gsc::test
