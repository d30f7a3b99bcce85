// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace gsc::test {

// The repository that the tests were built from. Told to one file alone, so that a compiler cache knows the others again
// in another folder.
std::string sourceFolder();

} // namespace gsc::test
