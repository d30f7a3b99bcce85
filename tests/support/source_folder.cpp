// SPDX-License-Identifier: Apache-2.0
#include "tests/support/source_folder.h"

std::string gsc::test::sourceFolder()
{
    return GSC_SOURCE_DIR;
}
