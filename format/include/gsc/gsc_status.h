// SPDX-License-Identifier: Apache-2.0
// Numbered problems that a .gsc file can have. gsc_issues.def has the table; an id is never reused or renumbered.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

namespace gsc {

enum class Severity { Warning, Error, Fatal }; // Fatal: what comes after the problem cannot be checked

struct IssueInfo {
    uint16_t id;
    Severity severity;
    const char* name;    // identifier that never changes, such as "ChunkPayloadRange"
    const char* summary; // the problem in one sentence
    const char* detail;  // printf format for `detail` of an Issue
};

struct Issue {
    const IssueInfo* info;
    uint64_t offset;     // place of the problem in the file, in bytes
    std::string pointer; // place of the problem in words like a JSON pointer, such as "/chunks/17/payload_offset"
    std::string detail;  // text with the values found
};

using IssueSink = std::function<void(const Issue&)>;

// All problems that the table has, ascending by id.
std::span<const IssueInfo> allIssues();

// Entry of the table for `id`. Precondition: `id` is in the table (constants: gsc_issues.h).
const IssueInfo& issueInfo(uint16_t id);

// Returns true if the problem means that the file is newer than this reader, rather than damaged. The exit code is then
// Unsupported.
bool isUnsupported(const IssueInfo& info);

// Name of a section as printable text, such as "ANCH".
std::string fourCcText(uint32_t type);

// Sink for a caller that cannot go on with a faulty file: it throws Error (InvalidFile, Unsupported) with the first
// issue of the file at `path` that is more than a warning.
IssueSink throwFirstIssue(const std::string& path);

} // namespace gsc
