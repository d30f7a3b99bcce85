// SPDX-License-Identifier: Apache-2.0
// Files that a program adds rows to, one JSON object per line. A file is read before any work, so that rows are never added
// to a file of another kind.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// A kind of rows, with words for messages about it.
struct RowKind {
    std::string_view start;       // first bytes of every line
    const char* command;          // command that writes such rows
    const char* expected;         // right content of a file, in words
    const char* option = "--out"; // option that names the file
};

// Measurements (schemas/run.schema.json).
extern const RowKind kRunRow;

// A file of rows of one kind that a program reads, then adds to.
class RowFile {
public:
    // Hands every row to `take` with its place for messages, such as "runs.jsonl:12"; `take` throws for a row that it cannot
    // use. A file that is missing, empty or "-" has no rows. A half-written last line is left behind by a run that was
    // killed: the next row takes its place. The file is not changed here. Throws Error: InvalidFile for a line that is no
    // row; Unsupported for a row of another version; Io; as `take`.
    using Take = std::function<void(const nlohmann::ordered_json& row, const std::string& where)>;
    RowFile(std::string path, const RowKind& kind, const Take& take);

    [[nodiscard]] const std::string& path() const { return m_path; }
    [[nodiscard]] const RowKind& kind() const { return *m_kind; }
    [[nodiscard]] const std::string& cutOff() const { return m_cut_off; } // the half-written line in words, or empty

    // Adds a line behind the last whole line; if that fails, the file keeps its rows. Throws Error(Io), also if the file
    // has changed meanwhile: two programs cannot share one file.
    void add(std::string_view line);

private:
    void read(const std::string& text, const Take& take);

    std::string m_path, m_cut_off;
    const RowKind* m_kind;
    uint64_t m_bytes = 0; // bytes of the file, with a half-written last line
    uint64_t m_whole = 0; // bytes of its whole lines, each with its line end
};

// Adds a line to a file that RowFile accepted; other programs may add to it at the same time. Throws Error as appendLine().
void addRow(const std::string& path, const RowKind& kind, std::string_view line);

} // namespace gsc
