// SPDX-License-Identifier: Apache-2.0
// Tools of the tests of a GPU's backend.
#pragma once

#include "tests/backends/backend.h"
#include "tests/kernels/synthetic_model.h"

#include <memory>
#include <vector>

namespace gsc::test {

// Factor for models that are to fill the slots that a large device's warps reserve; 1 in emulation, which has few.
#ifdef GSC_CUDA_EMULATION
constexpr uint32_t kManyAnchors = 1;
#else
constexpr uint32_t kManyAnchors = 24;
#endif

// The CUDA backend, made once; throws where there is none (the executable has left by then).
Renderer& cudaRenderer();

} // namespace gsc::test
