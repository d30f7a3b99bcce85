// SPDX-License-Identifier: Apache-2.0
// How a test executable says that it had nothing to test.
#pragma once

#include <cstdio>

namespace gsc::test {

// Set where the trained models that a test needs are missing.
inline bool g_without_models = false;

// Ends main() with what doctest returned.
inline int sayIfSkipped(int result)
{
    // said only where nothing failed: CTest takes a test with this line for skipped, whatever it returned
    if (result == 0 && g_without_models)
        std::printf("skipped: no trained models; set GSC_CHECKPOINTS to their folder\n");
    return result;
}

} // namespace gsc::test
