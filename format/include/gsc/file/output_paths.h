// SPDX-License-Identifier: Apache-2.0
// Checks a command's outputs before any work begins: none may be one of its inputs or another of its outputs, and all
// must be writable.
#pragma once

#include <span>
#include <string>

namespace gsc {

struct NamedPath {
    std::string path;
    std::string what; // word for the path in messages, such as "--report"
};

// A Text may go to standard output, whose path is "-"; a Binary may not.
enum class OutputKind { Text, Binary };
enum class OutputFolder { Exists, IsMade }; // whether the output's parent folder must exist, or will be made

[[nodiscard]] bool isStandardOutput(const std::string& path); // true if `path` is "-"

// Throws Error(Usage) if an output is also an input or another output: an equal path once symbolic links and dots are
// resolved, or an existing file under another name. Paths that do not exist yet are compared too, standard output is
// not.
void checkOutputsDiffer(std::span<const NamedPath> outputs, std::span<const NamedPath> inputs);

// Returns the file or folder that `path` stands for: symbolic links are followed, also those whose target does not
// exist yet. Throws Error(Io) for a path that can be no output: an empty name, a loop of links, a name that is too
// long, a name in /dev, or one that leads through the descriptors of a process, such as /dev/stdout. A folder that does
// not exist is no error.
std::string resolveOutput(const std::string& path);

// Checks that a file can be written. Throws Error(Io) for a path that resolveOutput() refuses; for a folder, a device,
// a pipe or a socket; for a file that exists, unless `overwrite`; and if the parent folder may not be written, or is
// missing and `folder` is Exists. Throws Error(Usage) for "-" as a binary output.
void checkOutput(const std::string& path, OutputKind kind, bool overwrite, OutputFolder folder = OutputFolder::Exists);
// Checks like checkOutput() a text that lines are appended to; it may exist.
void checkAppend(const std::string& path);
// Checks like checkOutput() a folder that is to be made; it may exist if it is empty.
void checkOutputFolder(const std::string& path, bool overwrite);

// Throws Error(Usage) if `path` is "-" and the summary, which goes to standard output, is JSON: there may be only one
// document. `option` is the name of the option in the message.
void checkStandardOutput(const std::string& path, const char* option, bool json_summary);

// Part of `path` before its last slash; "." without a slash, "/" for a name in the root folder.
std::string folderOf(const std::string& path);
// Throws Error(Io) with the text "<path>: <what> (<reason>), expected ...; ..."; `code` is a value of errno and gives
// the reason.
[[noreturn]] void failOutput(const std::string& path, const char* what, int code);

} // namespace gsc
