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

struct RowFile {
    uint64_t bytes = 0;     // of the file
    uint64_t whole = 0;     // of its whole lines, less the end that is missing
    bool needs_end = false; // of the last line, which is whole otherwise: addRow() gives it one
    std::string cut_off;    // what to say of a half-written last line, which a killed run left; empty = there is none
};

// Hands every row to `take`, which returns false for one that it cannot use. A file that is missing, empty or "-" has no
// rows. The file is not changed. Throws Error: InvalidFile for a line that is no row, Io.
RowFile readRows(const std::string& path, const RowKind& kind,
                 const std::function<bool(const nlohmann::ordered_json&)>& take);

// Adds a line to a file that readRows() took. Throws Error as appendLine().
void addRow(const std::string& path, const RowKind& kind, std::string_view line);

// Throws Error(Io) where the file has not the `bytes` that it was left with: two programs cannot share one.
void checkUntouched(const std::string& path, uint64_t bytes, const RowKind& kind);

} // namespace gsc
