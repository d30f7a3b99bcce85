// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/grids/nanovdb_check.h"
#include "convert/commands/manifest_check.h"
#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>
#include "runtime/cli/version.h"

namespace gsc {

namespace {

// most problems that are printed, because a damaged file can have one per record; the rest is counted
constexpr uint64_t kMaxMessages = 1000;

struct ValidateOptions {
    std::string input;
    GscCheck check = GscCheck::Full;
    bool warnings_as_errors = false;
    bool list_issues = false;
};

const char* severityName(Severity severity)
{
    constexpr const char* names[] = {"warning", "error", "fatal"};
    return names[size_t(severity)];
}

struct IssueCounts {
    uint64_t by_severity[3] = {};
    uint64_t reported = 0;
    uint64_t unsupported = 0; // number of errors that mean that the file is newer than this program

    [[nodiscard]] uint64_t of(Severity severity) const { return by_severity[size_t(severity)]; }
    [[nodiscard]] uint64_t total() const { return by_severity[0] + by_severity[1] + by_severity[2]; }
};

ErrorCode listIssues(Reporter& report)
{
    Json list = Json::array();
    for (const IssueInfo& info : allIssues()) {
        if (report.json())
            list.push_back({{"id", info.id},
                            {"severity", severityName(info.severity)},
                            {"code", info.name},
                            {"summary", info.summary}});
        else
            report.text(
                formatString("%s-%u %s: %s", severityName(info.severity), unsigned(info.id), info.name, info.summary));
    }
    if (report.json())
        report.object({{"schema", "gsc.issues/1"}, {"issues", std::move(list)}});
    return ErrorCode::Ok;
}

ErrorCode runValidate(const ValidateOptions& options, Reporter& report)
{
    if (options.list_issues && !options.input.empty())
        throw Error(ErrorCode::Usage, "--list-issues", "found with FILE, which it does not read", "one of the two",
                    "leave one out");
    if (options.list_issues)
        return listIssues(report);
    if (options.input.empty())
        throw Error(ErrorCode::Usage, "FILE", "not given", "it behind gsc validate", "see gsc validate --help");

    IssueCounts counts;
    Json messages = Json::array();
    const IssueSink sink = [&](const Issue& issue) {
        ++counts.by_severity[size_t(issue.info->severity)];
        counts.unsupported += issue.info->severity != Severity::Warning && isUnsupported(*issue.info);
        if (counts.reported == kMaxMessages)
            return;
        ++counts.reported;
        if (report.json())
            messages.push_back({{"id", issue.info->id},
                                {"code", issue.info->name},
                                {"severity", severityName(issue.info->severity)},
                                {"pointer", issue.pointer},
                                {"offset", issue.offset},
                                {"message", issue.info->summary},
                                {"details", issue.detail}});
        else
            report.text(formatString("%s-%u %s\n    %s (%s%sbyte %llu)", severityName(issue.info->severity),
                                     unsigned(issue.info->id), issue.info->summary, issue.detail.c_str(),
                                     issue.pointer.c_str(), issue.pointer.empty() ? "" : ", ",
                                     static_cast<unsigned long long>(issue.offset)));
    };
    const GscFile file(options.input, sink);
    GscView view;
    if (file.isSound() && openGsc(file.bytes(), view, options.check, sink)) {
        checkManifest(view, sink);
        checkNanoVdb(view, sink);
    }

    const uint64_t errors = counts.of(Severity::Error) + counts.of(Severity::Fatal);
    const bool valid = errors == 0 && !(options.warnings_as_errors && counts.of(Severity::Warning));
    const uint64_t truncated = counts.total() - counts.reported;
    if (report.json())
        report.object({{"schema", "gsc.validate/1"},
                       {"tool", {{"name", "gsc"}, {"version", toolVersion()}}},
                       {"uri", options.input},
                       {"check", options.check == GscCheck::Full ? "full" : "index"},
                       {"valid", valid},
                       {"summary",
                        {{"fatals", counts.of(Severity::Fatal)},
                         {"errors", counts.of(Severity::Error)},
                         {"warnings", counts.of(Severity::Warning)},
                         {"truncated", truncated}}},
                       {"messages", std::move(messages)}});
    else if (truncated)
        report.text(formatString("... and %s more", formatCount(truncated).c_str()));
    if (valid)
        return ErrorCode::Ok;
    return errors > 0 && errors == counts.unsupported ? ErrorCode::Unsupported : ErrorCode::InvalidFile;
}

} // namespace

void addValidateCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ValidateOptions>();
    CLI::App& command = addCommand(app, "validate", "Check a .gsc file and list every problem found");
    addText(command, "FILE", options->input, "FILE.gsc", "file to check");
    addChoice<GscCheck>(command, "--check", options->check, {{"index", GscCheck::Index}, {"full", GscCheck::Full}},
                        "default: full",
                        "part of the file to check: full: all; index: all but the anchors' data, which is fast");
    addFlag(command, "-e,--warnings-as-errors", options->warnings_as_errors,
            "warnings fail the check too, with exit code 3");
    addFlag(command, "--list-issues", options->list_issues,
            "list all problems that a check can find, with their numbers, and end");
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, "Prints nothing if the file is valid. Exit codes: 0 valid, 3 not valid, 5 of a\n"
                       "newer version than this program reads.\n\n"
                       "examples:\n"
                       "  gsc validate city.gsc\n"
                       "  gsc validate --format json --check index city.gsc");
    onParsed(command, invocation, options, runValidate);
}

} // namespace gsc
