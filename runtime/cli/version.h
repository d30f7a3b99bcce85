// SPDX-License-Identifier: Apache-2.0
// Version and commit of the tools, and the text of --version.
#pragma once

#include <string>

namespace gsc {

std::string toolVersion(); // "0.1.0"
std::string toolCommit();  // empty where the sources were no checkout

// The lines behind --version: program, commit, file format, compiler's target of CUDA. No line ends the text.
std::string versionText(const std::string& program);

} // namespace gsc
