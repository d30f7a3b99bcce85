// SPDX-License-Identifier: Apache-2.0
// Entry of the GPU tests: 77 (skipped, to CTest) where no device is usable, unless GSC_REQUIRE_GPU is set.
#define DOCTEST_CONFIG_IMPLEMENT
#include "runtime/cuda/renderer_cuda.h"
#include "tests/support/skipped.h"

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv)
{
    constexpr int kSkipped = 77;
    const gsc::DeviceInfo status = gsc::lookAtCudaDevice(0);
    std::printf("%s: %s\n", status.usable ? "device" : "no device", status.text.c_str());
    if (!status.usable)
        return std::getenv("GSC_REQUIRE_GPU") != nullptr ? 1 : kSkipped;
    return gsc::test::sayIfSkipped(doctest::Context(argc, argv).run());
}
