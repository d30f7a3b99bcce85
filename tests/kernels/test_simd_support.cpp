// SPDX-License-Identifier: Apache-2.0
#include "kernels/simd/simd_support.h"

#include <hwy/targets.h>

#include <doctest/doctest.h>

TEST_CASE("our list of this machine's instruction sets is that of Highway's library")
{
    int64_t known = HWY_STATIC_TARGET;
#if HWY_ARCH_X86
    known |= HWY_SSSE3 | HWY_SSE4 | HWY_AVX2 | HWY_AVX3;
#endif
    // note: Highway's list need not name the baseline
    CHECK(((hwy::SupportedTargets() | HWY_STATIC_TARGET) & known) == gsc::supportedSimdTargets());
}
