// SPDX-License-Identifier: Apache-2.0
// Checks of a command's outputs before any work: none may be one of its inputs or another of its outputs, and all must
// be writable.
#pragma once

#include <span>
#include <string>

namespace gsc {

struct NamedPath {
    std::string path;
    std::string what; // for the message, such as "--report"
};

// A text may go to standard output, which is named "-".
enum class OutputKind { Text, Binary };
enum class OutputFolder { Exists, IsMade }; // the one that the output lies in

[[nodiscard]] bool isStandardOutput(const std::string& path); // "-"

// Throws Error(Usage) if an output is an input or another output: the same path once symbolic links and dots are
// resolved, or the same existing file under another name. Paths that do not exist yet are compared too, standard output
// is not.
void checkOutputsDiffer(std::span<const NamedPath> outputs, std::span<const NamedPath> inputs);

// The file or folder that `path` stands for: symbolic links are followed, also those that lead to nothing yet. Throws
// Error(Io) for what can be no output: an empty name, a loop of links, a name that is too long, a name in /dev or one
// that leads through the descriptors of a process, such as /dev/stdout. A folder that does not exist is no error.
std::string resolveOutput(const std::string& path);

// Throws Error(Io) where a file cannot be written: what resolveOutput() refuses; a folder, a device, a pipe or a socket;
// a file that exists unless `overwrite`; one whose folder is missing (unless it is made) or may not be written. Throws
// Error(Usage) for "-" as a binary output.
void checkOutput(const std::string& path, OutputKind kind, bool overwrite, OutputFolder folder = OutputFolder::Exists);
// As checkOutput(), for a text that lines are added to: it may exist.
void checkAppend(const std::string& path);
// checkOutput() for a folder that is to be made; an empty one is no obstacle.
void checkOutputFolder(const std::string& path, bool overwrite);

// Throws Error(Usage) if `path` is "-" and the summary is JSON: standard output takes one document. `option` names it.
void checkStandardOutput(const std::string& path, const char* option, bool json_summary);

// The part before the last slash; "." or "/" if there is none.
std::string folderOf(const std::string& path);
// Throws Error(Io): "<path>: <what> (<reason>), expected ...; ...". `code` as errno has it.
[[noreturn]] void failOutput(const std::string& path, const char* what, int code);

} // namespace gsc
