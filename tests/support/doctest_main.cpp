// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

int main(int argc, char** argv)
{
    const int result = doctest::Context(argc, argv).run();
    // said only where nothing failed: CTest takes a test with this line for skipped, whatever it returned
    if (result == 0 && gsc::test::g_without_models)
        std::printf("skipped: no trained models; set GSC_CHECKPOINTS to their folder\n");
    return result;
}
