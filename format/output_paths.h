// SPDX-License-Identifier: Apache-2.0
// What a command writes must not fall on what it reads, nor on another of its outputs.
#pragma once

#include <span>
#include <string>

namespace gsc {

struct NamedPath {
    std::string path;
    std::string what; // for the message, such as "--report"
};

// Throws Error(Usage) if an output is an input or another output: the same path once symbolic links and dots are
// resolved, or the same existing file under another name. What does not exist yet is compared too.
void checkOutputsDiffer(std::span<const NamedPath> outputs, std::span<const NamedPath> inputs);

// Throws Error(Io) if `path` exists and is no regular file: a device or a pipe is not to be replaced by a file.
void checkRegularOrAbsent(const std::string& path);

} // namespace gsc
