// SPDX-License-Identifier: Apache-2.0
// Completion of a command line in bash, zsh and fish. A shell's script asks the program itself, so that it offers
// exactly the words that the program takes.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

enum class Shell { Bash, Zsh, Fish };

// The hidden first word with which a script asks.
inline constexpr const char* kCompleteCommand = "__complete";

// Lines for the last of `words`, which may be empty or begun: a candidate, a tab and what it is; ":files" with the
// ending wanted behind it, or none for all, where folders are offered too, to go on in; ":folders". By an option's placeholder (options.h): words separated by |
// are candidates, those in capitals name files: DIR, MODEL and CHECKPOINT folders, FILE.gsc files of an ending.
std::string completions(const CLI::App& root, const std::vector<std::string>& words);

// The script of a shell for `program`.
std::string completionScript(Shell shell, const std::string& program);

} // namespace gsc
