// SPDX-License-Identifier: Apache-2.0
// Small text files, whole.
#pragma once

#include <string>

namespace gsc {

// "-" is standard input. Throws Error(Io).
std::string readTextFile(const std::string& path);

} // namespace gsc
