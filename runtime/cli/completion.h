// SPDX-License-Identifier: Apache-2.0
// Completion of a command line in bash, zsh and fish. The shell's script asks the program itself, so that it offers
// exactly the words that the program takes.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

enum class Shell { Bash, Zsh, Fish };

// The first word with which a shell's script calls the program to ask; help does not show it.
inline constexpr const char* kCompleteCommand = "__complete";

// Returns lines of candidates for the last of `words`, which may be empty or incomplete. A line is a candidate, a tab
// and its description; or ":files" with the wanted ending behind it (none = all files), to which folders are offered,
// too; or ":folders". An option's placeholder (options.h) tells the candidates: words separated by | are the
// candidates themselves, DIR, MODEL and CHECKPOINT stand for folders, and FILE.gsc for files of this ending.
std::string completions(const CLI::App& root, const std::vector<std::string>& words);

// Returns the script for a shell that completes the words of `program`.
std::string completionScript(Shell shell, const std::string& program);

} // namespace gsc
