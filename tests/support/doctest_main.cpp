// SPDX-License-Identifier: Apache-2.0
#define DOCTEST_CONFIG_IMPLEMENT
#include "tests/support/skipped.h"

#include <doctest/doctest.h>

int main(int argc, char** argv)
{
    return gsc::test::sayIfSkipped(doctest::Context(argc, argv).run());
}
