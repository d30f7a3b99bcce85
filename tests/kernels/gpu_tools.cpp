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
