// SPDX-License-Identifier: Apache-2.0
#include <gsc/gsc_status.h>

#include <gsc/error.h>
#include <gsc/gsc_issues.h>

#include <algorithm>
#include <cassert>
#include <cinttypes>
#include <iterator>

namespace gsc {

namespace {

constexpr IssueInfo kIssues[] = {
#define GSC_ISSUE(id, severity, name, summary, detail) {id, Severity::severity, #name, summary, detail},
#include <gsc/gsc_issues.def>
#undef GSC_ISSUE
};

constexpr bool ascending()
{
    for (size_t i = 1; i < std::size(kIssues); ++i)
        if (kIssues[i].id <= kIssues[i - 1].id)
            return false;
    return true;
}
static_assert(ascending(), "the issue table is not ascending by id");

} // namespace

std::span<const IssueInfo> allIssues()
{
    return kIssues;
}

const IssueInfo& issueInfo(uint16_t id)
{
    const auto* const found = std::lower_bound(std::begin(kIssues), std::end(kIssues), id,
                                               [](const IssueInfo& info, uint16_t value) { return info.id < value; });
    assert(found != std::end(kIssues) && found->id == id);
    return *found;
}

bool isUnsupported(const IssueInfo& info)
{
    switch (info.id) {
    case issue::VersionUnsupported:
    case issue::ProfileUnsupported:
    case issue::SectionUnknown:
    case issue::SectionVersion:
    case issue::SectionCodec:
    case issue::ParamPayloadVersion:
    case issue::ArchiveCodecUnknown:
    case issue::ArchiveCodecMissing:
        return true;
    default:
        return false;
    }
}

std::string fourCcText(uint32_t type)
{
    std::string text;
    for (int i = 0; i < 4; ++i) {
        const unsigned char c = uint8_t(type >> 8 * i);
        text += c >= 0x20 && c < 0x7f ? std::string(1, char(c)) : formatString("\\x%02x", c);
    }
    return text;
}

IssueSink throwFirstIssue(const std::string& path)
{
    return [path](const Issue& issue) {
        if (issue.info->severity == Severity::Warning)
            return;
        // `detail` of an issue has the form `<found>[, expected <expected>][; <what to do>]`
        constexpr std::string_view kExpected = ", expected ";
        std::string found = issue.detail, expected = "a file as this gsc knows the format", remedy;
        const size_t stated = found.find(kExpected);
        if (const size_t end = found.find("; ", stated == std::string::npos ? 0 : stated); end != std::string::npos) {
            remedy = found.substr(end + 2) + "; ";
            found.resize(end);
        }
        if (stated != std::string::npos) {
            expected = found.substr(stated + kExpected.size());
            found.resize(stated);
        }
        throw Error(isUnsupported(*issue.info) ? ErrorCode::Unsupported : ErrorCode::InvalidFile, path,
                    formatString("issue %u %s at byte %llu: %s: %s", issue.info->id, issue.info->name,
                                 static_cast<unsigned long long>(issue.offset), issue.info->summary, found.c_str()),
                    expected, remedy + "see everything that is wrong with it, or make it again")
            .with({Setting::Validation, Setting::Conversion});
    };
}

} // namespace gsc
