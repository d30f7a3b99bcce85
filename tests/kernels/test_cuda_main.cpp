// SPDX-License-Identifier: Apache-2.0
// Entry of the GPU tests: 77 (skipped, to CTest) where no device is usable, unless GSC_REQUIRE_GPU is set.
#define DOCTEST_CONFIG_IMPLEMENT
#include "runtime/backend_cuda.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>

using namespace gsc;
using namespace gsc::test;

Backend& gsc::test::cudaBackend()
{
    static const std::unique_ptr<Backend> backend = makeCudaBackend();
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

int main(int argc, char** argv)
{
    constexpr int kSkipped = 77;
    const CudaStatus status = cudaStatus();
    std::printf("%s: %s\n", status.usable ? "device" : "no device", status.text.c_str());
    if (!status.usable)
        return std::getenv("GSC_REQUIRE_GPU") != nullptr ? 1 : kSkipped;
    return doctest::Context(argc, argv).run();
}
