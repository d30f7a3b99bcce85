// SPDX-License-Identifier: Apache-2.0
// Numbered problems a .gsc file can have. The table is gsc_issues.def; ids are never reused or renumbered.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

namespace gsc {

enum class Severity { Warning, Error, Fatal }; // Fatal = nothing after it can be checked

struct IssueInfo {
    uint16_t id;
    Severity severity;
    const char* name;    // stable identifier, such as "ChunkPayloadRange"
    const char* summary; // one sentence
    const char* detail;  // printf format of the values
};

struct Issue {
    const IssueInfo* info;
    uint64_t offset;     // offset of the problem in the file
    std::string pointer; // JSON-pointer-like place, such as "/chunks/17/payload_offset"
    std::string detail;  // formatted values
};

using IssueSink = std::function<void(const Issue&)>;

// The whole table, ascending by id.
std::span<const IssueInfo> allIssues();

// One line of it. Precondition: `id` is in the table (constants: gsc_issues.h).
const IssueInfo& issueInfo(uint16_t id);

// True if the issue says that the file is newer than this reader, rather than damaged. Its exit code is then
// Unsupported.
bool isUnsupported(const IssueInfo& info);

// The type of a section, "ANCH", printable.
std::string fourCcText(uint32_t type);

// For who cannot go on with a file that is not good: throws Error (InvalidFile, Unsupported) with the first issue of the
// file at `path` that is more than a warning.
IssueSink throwFirstIssue(const std::string& path);

} // namespace gsc
