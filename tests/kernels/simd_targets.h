// SPDX-License-Identifier: Apache-2.0
// Runs a test with every instruction set that was compiled and this machine has.
#pragma once

#include <hwy/targets.h>

#include <cstdint>

namespace gsc::test {

template <typename Body>
void forEachTarget(Body&& body)
{
    // note: SupportedTargets() need not name the baseline, which is what an old machine runs
    const int64_t wanted = HWY_AVX3 | HWY_AVX2 | HWY_SSE4 | HWY_NEON;
    for (int64_t targets = (hwy::SupportedTargets() & wanted) | HWY_STATIC_TARGET; targets != 0;
         targets &= targets - 1) {
        const int64_t target = targets & -targets;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().DeInit();
        body(hwy::TargetName(target));
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
}

} // namespace gsc::test
