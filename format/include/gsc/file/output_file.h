// SPDX-License-Identifier: Apache-2.0
// Writes files: each is a temporary beside its target until commit() renames it. If the target is a symbolic link, the
// file that it leads to is replaced. A file that existed keeps its permission bits, and its owner and group where the
// system allows that.
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
    // Creates the temporary, or takes standard output for a text whose path is "-". Throws Error as checkOutput().
    OutputFile(const std::string& path, OutputKind kind, bool overwrite);
    ~OutputFile(); // removes the temporary; without commit() the target stays as it was
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    // Appends `bytes` to the file. Throws Error(Io), also when the disk is full.
    void write(std::span<const std::byte> bytes);
    void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
    // Writes `bytes` at `offset` bytes from the start of the file; thread-safe. Not for standard output. Throws
    // Error(Io).
    void writeAt(uint64_t offset, std::span<const std::byte> bytes);
    [[nodiscard]] int descriptor() const;                   // descriptor of the temporary file, to read and write
    [[nodiscard]] const std::string& temporaryPath() const; // path until commit(); not for standard output
    // Waits until the content is on the disk; commit() then does so for the name too. Throws Error(Io).
    void sync();
    // Gives the file its name; to be called once. Throws Error(Io); the target is then as it was.
    void commit();

private:
    struct State;
    std::unique_ptr<State> m_state;
};

// Several files that appear together: all are written before the first one gets its name.
class OutputFiles {
public:
    explicit OutputFiles(bool overwrite) : m_overwrite(overwrite) {}
    ~OutputFiles(); // removes the folders that this object made, unless commit() succeeded
    OutputFiles(const OutputFiles&) = delete;
    OutputFiles& operator=(const OutputFiles&) = delete;

    // The functions below throw Error(Io).
    void makeFolder(const std::string& path); // does nothing if it exists; parent folders are not made
    void add(const std::string& path, OutputKind kind, std::string_view bytes);
    // Gives all files their names. Throws Error(Interrupted) before the first; if a later one fails, the earlier ones
    // stay.
    void commit();

private:
    bool m_overwrite;
    std::vector<std::string> m_folders; // folders that this object created
    std::vector<std::unique_ptr<OutputFile>> m_files;
};

// Writes `text` as a whole file. Throws Error(Io), also if the file exists and `overwrite` is false.
void writeTextFile(const std::string& path, std::string_view text, bool overwrite);

// Returns true if `tail`, the last line of a file without its line end, is certainly a line that a killed program did
// not finish: it begins with `line_start`, or is a beginning of it of more than one character.
bool isCutLine(std::string_view tail, std::string_view line_start);

// Appends `line` and a line end to a file of lines, or prints it where `path` is "-". Lines that several programs
// append at once are not mixed. If the file's last line has no end, it gets one if it starts with `line_start` and
// `is_whole` returns true for it, and it is removed if isCutLine(). Throws Error: Io, the file is then as before;
// InvalidFile for any other last line without an end.
void appendLine(const std::string& path, std::string_view line, std::string_view line_start,
                const std::function<bool(std::string_view)>& is_whole);

} // namespace gsc
