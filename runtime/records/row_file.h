// SPDX-License-Identifier: Apache-2.0
// Files that a program adds rows to, one JSON object per line: read before any work, so that no other file is added to.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct RowKind {
    std::string_view start;       // of every line
    const char* command;          // that writes such rows
    const char* expected;         // for the message
    const char* option = "--out"; // that names the file
};

// Measurements (schemas/run.schema.json).
extern const RowKind kRunRow;

class RowFile {
public:
    // Hands every row to `take`, which returns false for one that it cannot use. A file that is missing, empty or "-" has
    // no rows. A half-written last line is what a killed run left behind: the next row takes its place. The file is not
    // changed. Throws Error: InvalidFile for a line that is no row; Unsupported for a row of another version; Io.
    RowFile(std::string path, const RowKind& kind, const std::function<bool(const nlohmann::ordered_json&)>& take);

    [[nodiscard]] const std::string& path() const { return m_path; }
    [[nodiscard]] const RowKind& kind() const { return *m_kind; }
    [[nodiscard]] const std::string& cutOff() const { return m_cut_off; } // the half-written line in words, or empty

    // Adds a line behind the last whole one; where that fails the file has what it had. Throws Error(Io), also where the
    // file is not as it was left: two programs cannot share one.
    void add(std::string_view line);

private:
    void read(const std::string& text, const std::function<bool(const nlohmann::ordered_json&)>& take);

    std::string m_path, m_cut_off;
    const RowKind* m_kind;
    uint64_t m_bytes = 0; // of the file, with what a killed run left
    uint64_t m_whole = 0; // of its whole lines, each with its end
};

// Adds a line to a file that RowFile took, which others may add to at the same time. Throws Error as appendLine().
void addRow(const std::string& path, const RowKind& kind, std::string_view line);

} // namespace gsc
