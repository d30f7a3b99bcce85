// SPDX-License-Identifier: Apache-2.0
// Version and commit of the tools, and the text of --version.
#pragma once

#include <string>

namespace gsc {

std::string toolVersion(); // version of the tools, such as "0.1.0"
std::string toolCommit();  // commit that the sources were built from; empty if they were no git checkout

// Returns the text of --version: program, commit, file format and targets of CUDA code, without a line end at the end.
std::string versionText(const std::string& program);

} // namespace gsc
