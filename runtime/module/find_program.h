// SPDX-License-Identifier: Apache-2.0
// Finds where this program lies, and other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace gsc {

// Returns folders that this program may lie in, the most certain first.
std::vector<std::filesystem::path> programFolders();

// Returns the path of a program: in PATH; or that of one of ours, which lies beside this one or in ../bin from there,
// as in the build folder, and else in PATH. Empty if it is in none.
std::string programInPath(const std::string& name);
std::string ownProgram(const std::string& name);

} // namespace gsc
