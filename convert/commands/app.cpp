// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "convert/commands/parse_size.h"
#include "format/file_fault.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <map>
#include <memory>
#include <new>

namespace gsc {

namespace {

const char* const kFooter = R"(exit codes:
  0 ok (warnings allowed)   1 usage              2 input/output, disk full   3 invalid file
  4 internal                5 unsupported        6 out of memory             7 device
  8 difference or threshold exceeded           130 interrupted (nothing half-written is left)

Results go to stdout, everything else to stderr. `gsc help COMMAND` tells more about one command.)";

// A command that could not do its work. With --format json a program still finds one object on stdout.
ErrorCode fail(Reporter& report, ErrorCode code, const std::string& message)
{
    report.endProgress(true);
    report.error(message);
    if (report.json()) {
        report.object(
            {{"schema", "gsc.error/1"}, {"code", errorName(code)}, {"exit_code", int(code)}, {"message", message}});
        std::fflush(stdout);
    }
    return code;
}

} // namespace

ErrorCode runInvocation(const Invocation& invocation)
{
    Reporter report(invocation.reporter);
    installFileFaultHandler(report.json());
    try {
        const ErrorCode code = invocation.run(report);
        report.endProgress(false);
        report.flush();
        return code;
    } catch (const Error& error) {
        return fail(report, error.code(), error.what());
    } catch (const std::bad_alloc&) {
        return fail(report, ErrorCode::OutOfMemory,
                    formatString("out of memory: peak was %s, expected more to be available; close other programs or "
                                 "lower --memory-budget",
                                 formatBytes(peakMemoryBytes()).c_str()));
    } catch (const std::exception& error) {
        return fail(report, ErrorCode::Internal, std::string("internal error: ") + error.what());
    } catch (...) {
        return fail(report, ErrorCode::Internal, "internal error: unknown exception");
    }
}

namespace {

void addHelpCommand(CLI::App& app)
{
    auto name = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand("help", "Show the help of a command");
    command->add_option("command", *name, "the command");
    command->callback([&app, name] {
        std::string help = app.help();
        if (!name->empty()) {
            const auto wanted = app.get_subcommands([&](CLI::App* other) { return other->get_name() == *name; });
            if (wanted.empty())
                throw CLI::ValidationError("help", "there is no command " + *name);
            help = wanted.front()->help("gsc");
        }
        std::fputs(help.c_str(), stdout);
    });
}

CLI::Option* addParsedOption(CLI::App& command, const char* names, uint64_t& value, const char* help,
                             std::optional<uint64_t> (*parse)(std::string_view), const char* expected)
{
    const auto assign = [&value, parse](const std::vector<std::string>& texts) {
        const auto parsed = parse(texts.back());
        if (parsed)
            value = *parsed;
        return parsed.has_value();
    };
    return command.add_option(names, assign, help)->type_name(expected)->expected(1);
}

} // namespace

void addReporterOptions(CLI::App& command, ReporterOptions& options, bool takes_long)
{
    static const std::map<std::string, ReportFormat> kFormats = {{"text", ReportFormat::Text},
                                                                 {"json", ReportFormat::Json}};
    static const std::map<std::string, ProgressMode> kModes = {{"auto", ProgressMode::Auto},
                                                               {"bar", ProgressMode::Bar},
                                                               {"plain", ProgressMode::Plain},
                                                               {"json", ProgressMode::Json},
                                                               {"none", ProgressMode::None}};
    const char* group = "Output";
    command.add_option("--format", options.format, "form of the result on stdout (default: text)")
        ->transform(CLI::CheckedTransformer(kFormats))
        ->option_text("text|json")
        ->group(group);
    if (takes_long)
        command
            .add_option("--progress", options.progress,
                        "form of the progress on stderr; auto is a bar on a terminal, else lines (default: auto)")
            ->transform(CLI::CheckedTransformer(kModes))
            ->option_text("auto|bar|plain|json|none")
            ->group(group);
    command.add_flag("-q,--quiet", options.quiet, "only errors on stderr")->group(group);
    command.add_flag("-v,--verbose", options.verbose, "say more on stderr")->group(group);
    command.add_flag("--no-color", options.no_color, "no colour on stderr; NO_COLOR in the environment does the same")
        ->group(group);
}

CLI::Option* addByteSizeOption(CLI::App& command, const char* names, uint64_t& value, const char* help)
{
    return addParsedOption(command, names, value, help, parseByteSize, "SIZE");
}

CLI::Option* addCountOption(CLI::App& command, const char* names, uint64_t& value, const char* help)
{
    return addParsedOption(command, names, value, help, parseCount, "COUNT");
}

int runGsc(int argc, const char* const* argv)
{
    CLI::App app("Turns trained Scaffold-GS and Octree-GS models into .gsc files, and checks them.", "gsc");
    app.set_version_flag("--version", versionText());
    app.require_subcommand(0, 1); // checked below: an unknown word is then named before a missing command
    app.footer(kFooter);
    app.failure_message(CLI::FailureMessage::simple);
    Invocation invocation;
    addConvertCommand(app, invocation);
    addValidateCommand(app, invocation);
    addInfoCommand(app, invocation);
    addCompareCommand(app, invocation);
    addChartCommand(app, invocation);
    addSampleCommand(app, invocation);
    addHelpCommand(app);
    try {
        app.parse(argc, argv);
        if (app.get_subcommands().empty())
            throw CLI::RequiredError("a command");
    } catch (const CLI::Success& wanted) { // --help, --version
        return app.exit(wanted);
    } catch (const CLI::Error& error) {
        std::fprintf(stderr, "error: usage: %s; see gsc --help\n", error.what());
        return int(ErrorCode::Usage);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: internal error: %s\n", error.what());
        return int(ErrorCode::Internal);
    }
    if (!invocation.run) // help
        return int(ErrorCode::Ok);
    return int(runInvocation(invocation));
}

} // namespace gsc
