// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/gpu_tools.h"

#include "runtime/cuda/renderer_cuda.h"

using namespace gsc;
using namespace gsc::test;

Renderer& gsc::test::cudaRenderer()
{
    static const std::unique_ptr<Renderer> backend = makeCudaRenderer(0, {});
    return *backend;
}

EyeParams gsc::test::eyeAt(float x, float z, uint32_t width, uint32_t height)
{
    const float position[3] = {x, 0.3f, z}, target[3] = {0.1f, -0.2f, 0.3f};
    return lookAt(position, target, 1.1f, width, height);
}

EyeParams gsc::test::eyeAhead(float x, float z, uint32_t width, uint32_t height)
{
    const float position[3] = {x, 0.3f, z}, target[3] = {x, 0.25f, z + 1};
    return lookAt(position, target, 1.1f, width, height);
}

FrameOptions gsc::test::onGrey(Tier tier)
{
    FrameOptions options;
    options.tier = tier;
    options.background[0] = options.background[1] = options.background[2] = 0.5f;
    return options;
}
