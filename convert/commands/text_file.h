// SPDX-License-Identifier: Apache-2.0
// Small text files, whole.
#pragma once

#include <string>

namespace gsc {

// Throws Error(Io) if `path` exists and may not be overwritten, or its folder does not exist.
void checkOutputPath(const std::string& path, bool overwrite);
// The same for a folder that is to be made; an empty one is no obstacle.
void checkOutputFolder(const std::string& path, bool overwrite);
// Writes a temporary file beside `path` and renames it. Throws Error(Io); then `path` is as it was.
void writeTextFile(const std::string& path, const std::string& text);
// Throws Error(Io).
std::string readTextFile(const std::string& path);

} // namespace gsc
