// SPDX-License-Identifier: Apache-2.0
// Every file that a program writes: a temporary beside the target, then a rename. A target that is a symbolic link is
// written through. One that exists keeps its permission bits, and its owner and group where the system lets it.
#pragma once

#include <gsc/file/output_paths.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gsc {

class OutputFile {
public:
    // Creates the temporary, or takes standard output for a text named "-". Throws Error as checkOutput().
    OutputFile(const std::string& path, OutputKind kind, bool overwrite);
    ~OutputFile(); // without commit() the target stays as it was
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    // Appends. Throws Error(Io), also when the disk is full.
    void write(std::span<const std::byte> bytes);
    void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
    // Positional, bytes from the start; thread-safe. Not for standard output.
    void writeAt(uint64_t offset, std::span<const std::byte> bytes);
    [[nodiscard]] int descriptor() const;                   // descriptor of the temporary file, to read and write
    [[nodiscard]] const std::string& temporaryPath() const; // not for standard output
    // Waits for the disk; commit() then does so for the name too. Throws Error(Io).
    void sync();
    // Gives the file its name, once. Throws Error(Io); the target is then as it was.
    void commit();

private:
    struct State;
    std::unique_ptr<State> m_state;
};

// Files that appear together: all are written before the first gets its name.
class OutputFiles {
public:
    explicit OutputFiles(bool overwrite) : m_overwrite(overwrite) {}
    ~OutputFiles(); // removes the folders it made, unless commit() came to its end
    OutputFiles(const OutputFiles&) = delete;
    OutputFiles& operator=(const OutputFiles&) = delete;

    // All throw Error(Io).
    void makeFolder(const std::string& path); // unless it exists; parents are not made
    void add(const std::string& path, OutputKind kind, std::string_view bytes);
    // Throws Error(Interrupted) before the first name is given. Where a later one fails the earlier stay.
    void commit();

private:
    bool m_overwrite;
    std::vector<std::string> m_folders; // folders that this created
    std::vector<std::unique_ptr<OutputFile>> m_files;
};

// The whole of a small text. Throws Error(Io), without `overwrite` also where the file is there by then.
void writeTextFile(const std::string& path, std::string_view text, bool overwrite);

// True if a last line without its end is certainly the rest that a killed program left of a line that starts with
// `line_start`: it has all of that, or more than one character of it.
bool isCutLine(std::string_view tail, std::string_view line_start);

// Adds `line` and its end to a file of lines, or prints it where `path` is "-". Lines of programs side by side stay
// whole. A last line without its end gets one if it starts with `line_start` and `is_whole` says so, and goes if
// isCutLine(). Throws Error: Io, and the file has what it had; InvalidFile for another last line without an end.
void appendLine(const std::string& path, std::string_view line, std::string_view line_start,
                const std::function<bool(std::string_view)>& is_whole);

} // namespace gsc
