// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/tool.h"

#include <gsc/file/file_fault.h>
#include "format/machine/machine.h"
#include "format/machine/threads.h"
#include "runtime/cli/command_words.h"
#include "runtime/cli/completion.h"
#include "runtime/cli/help_page.h"
#include "runtime/cli/man_page.h"
#include "runtime/cli/options.h"
#include "runtime/cli/setting_words.h"
#include "runtime/cli/thread_guard.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace gsc {

namespace {

// Reports that a command failed. With --format json a program still finds one object on stdout.
ErrorCode fail(Reporter& report, const Error& error, const CLI::App* command)
{
    const Error told = withOptions(error, command);
    report.endProgress(true);
    report.error(told.what());
    if (report.json()) {
        report.object(errorJson(told));
        std::fflush(stdout);
    }
    return told.code();
}

Error errorOf(const std::exception_ptr& error)
{
    const auto internal = [](const char* what) { return internalError("internal error", what, "no such case"); };
    try {
        std::rethrow_exception(error);
    } catch (const Error& e) {
        return e;
    } catch (const std::filesystem::filesystem_error& e) {
        return {ErrorCode::Io, e.path1().empty() ? "path" : e.path1().string(), e.code().message(),
                "a path that can be used", "check it and its rights"};
    } catch (const std::bad_alloc&) {
        return {ErrorCode::OutOfMemory, "memory",
                formatString("none left after a peak of %s of the %s that this machine or container allows",
                             formatBytes(peakMemoryBytes()).c_str(), formatBytes(usableMemory()).c_str()),
                "more to be available",
                "close other programs, raise the limit, or ask for less (--memory-budget, --size, --threads)"};
    } catch (const std::system_error& e) {
        return e.code() == std::errc::resource_unavailable_try_again ? tooFewThreads("this command")
                                                                     : internal(e.what());
    } catch (const std::exception& e) {
        return internal(e.what());
    } catch (...) {
        return internal("an unknown exception");
    }
}

ErrorCode failWith(Reporter& report, const std::exception_ptr& error, const CLI::App* command)
{
    return fail(report, errorOf(error), command);
}

// Reads --format and --progress from a command line that may be wrong, so that its error has the form asked for.
ReporterOptions reporterOf(const std::vector<std::string>& words)
{
    ReporterOptions options;
    for (size_t i = 0; i < words.size(); ++i) {
        const auto is = [&](const std::string& name, const char* value) {
            return words[i] == name + "=" + value ||
                   (words[i] == name && i + 1 < words.size() && words[i + 1] == value);
        };
        if (is("--format", "json"))
            options.format = ReportFormat::Json;
        if (is("--progress", "json"))
            options.progress = ProgressMode::Json;
        options.no_color |= words[i] == "--no-color";
    }
    return options;
}

void parse(CLI::App& root, const Invocation& invocation, const CommandState& state)
{
    try {
        giveWords(root, state);
    } catch (const CLI::Error& e) { // CLI11 found a fault that checkWords() did not find
        throw Error(ErrorCode::Usage, "command line", e.what(), "what " + root.get_name() + " --help tells",
                    "correct it");
    }
    if (invocation.run)
        return;
    const std::string path = commandPath(*state.command);
    throw Error(ErrorCode::Usage, path, "no command given", listCommands(*state.command), "see " + path + " --help");
}

// Opens a file in place of each standard stream that was closed at the start; reading and writing it fails as before.
// Otherwise the next file to be opened would get the stream's number, and printed text would go into it.
void holdClosedStreams()
{
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(stream, F_GETFD) < 0)
            (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY); // the lowest number that is free
}

void addPageCommand(CLI::App& root, Invocation& invocation, const char* name, const char* help,
                    std::string (*text)(const CLI::App&, const std::string& topic))
{
    auto words = std::make_shared<std::vector<std::string>>();
    CLI::App& command = addCommand(root, name, help);
    addTexts(command, "COMMAND", *words, "COMMAND", "command as it is typed behind the program's name");
    onParsed(command, [&root, &invocation, words, text] {
        const CLI::App* wanted = &root;
        std::string page = text(root, "");
        for (const std::string& word : *words) {
            const CLI::App* const below = wanted != nullptr ? commandNamed(*wanted, word) : nullptr;
            page = below != nullptr ? text(*below, "") : wanted != nullptr ? text(*wanted, word) : "";
            if (page.empty())
                failCommand(word, wanted != nullptr ? *wanted : root);
            wanted = below;
        }
        invocation.run = [page](Reporter& report) {
            report.text(page);
            return ErrorCode::Ok;
        };
    });
}

} // namespace

OrderedJson errorJson(const Error& error)
{
    return {{"schema", "gsc.error/1"},      {"code", errorName(error.code())}, {"exit_code", int(error.code())},
            {"message", error.what()},      {"subject", error.subject()},      {"found", error.found()},
            {"expected", error.expected()}, {"remedy", error.remedy()}};
}

ErrorCode runInvocation(const Invocation& invocation)
{
    Reporter report(invocation.reporter);
    installFileFaultHandler(report.json(), report.options().progress == ProgressMode::Json);
    boundMemory();
    installThreadGuard(report.json(), report.options().progress == ProgressMode::Json);
    try {
        const ErrorCode code = invocation.run(report);
        report.endProgress(false);
        report.flush();
        return code;
    } catch (...) {
        return failWith(report, std::current_exception(), invocation.command);
    }
}

void addReporterOptions(CLI::App& command, ReporterOptions& options, bool takes_long)
{
    const Heading heading(command, "Output");
    addChoice<ReportFormat>(command, "--format", options.format,
                            {{"text", ReportFormat::Text}, {"json", ReportFormat::Json}}, "default: text",
                            "format of the result on standard output");
    if (takes_long)
        addChoice<ProgressMode>(
            command, "--progress", options.progress,
            {{"auto", ProgressMode::Auto},
             {"bar", ProgressMode::Bar},
             {"plain", ProgressMode::Plain},
             {"json", ProgressMode::Json},
             {"none", ProgressMode::None}},
            "default: auto", "format of messages and progress on standard error; auto: a bar on a terminal, else lines")
            .rare();
    addFlag(command, "-q,--quiet", options.quiet, "only errors on standard error");
    OptionHandle(command.add_flag("-v,--verbose", options.verbose, "print more messages on standard error")).rare();
    addFlag(command, "--no-color", options.no_color, "no colour; NO_COLOR in the environment does the same").rare();
}

void addToolCommands(CLI::App& root, Invocation& invocation)
{
    addPageCommand(root, invocation, "help", "Show the help of a command or topic",
                   [](const CLI::App& command, const std::string& topic) {
                       return topic.empty() ? helpPage(command, false) : topicPage(command, topic);
                   });
    addPageCommand(root, invocation, "man", "Print a manual page, to pipe into man -l -",
                   [](const CLI::App& command, const std::string& topic) {
                       return topic.empty() ? manPage(command) : std::string();
                   });
    auto shell = std::make_shared<Shell>();
    CLI::App* command = root.add_subcommand("completion", "Print the script for TAB completion in a shell");
    addChoice<Shell>(*command, "SHELL", *shell, {{"bash", Shell::Bash}, {"zsh", Shell::Zsh}, {"fish", Shell::Fish}}, "",
                     "shell to print it for")
        .required();
    const std::string name = root.get_name();
    command->footer("examples:\n  source <(" + name + " completion bash)\n  " + name + " completion zsh > ~/.zfunc/_" +
                    name + "\n  " + name + " completion fish > ~/.config/fish/completions/" + name + ".fish");
    command->callback([&root, &invocation, shell] {
        invocation.run = [text = completionScript(*shell, root.get_name())](Reporter& report) {
            report.text(text);
            return ErrorCode::Ok;
        };
    });
}

int runTool(CLI::App& root, Invocation& invocation, int argc, const char* const* argv)
{
    const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
    if (!words.empty() && words.front() == kCompleteCommand) {
        std::fputs(completions(root, {words.begin() + 1, words.end()}).c_str(), stdout);
        return int(ErrorCode::Ok);
    }
    Reporter report(reporterOf(words));
    try {
        const CommandState state = checkWords(root, words);
        if (state.help || state.version) {
            report.text(state.help ? helpPage(*state.command, state.help_all) : root.version());
            report.flush();
            return int(ErrorCode::Ok);
        }
        parse(root, invocation, state);
        invocation.command = state.command;
    } catch (...) {
        return int(failWith(report, std::current_exception(), nullptr));
    }
    return int(runInvocation(invocation));
}

int runProgram(const Program& program, int argc, const char* const* argv)
{
    holdClosedStreams();
    CLI::App root(program.description, program.name);
    root.set_help_flag("-h,--help", "show the most used options");
    root.set_help_all_flag("--help-all", "show all options");
    root.require_subcommand(0, 1);
    root.set_version_flag("--version", program.version, program.version_help);
    if (!program.footer.empty())
        root.footer(program.footer);
    Invocation invocation;
    program.add_commands(root, invocation);
    addToolCommands(root, invocation);
    return runTool(root, invocation, argc, argv);
}

} // namespace gsc
