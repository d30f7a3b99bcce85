// SPDX-License-Identifier: Apache-2.0
#include "format/error.h"
#include "format/file_fault.h"
#include "format/interrupt.h"
#include "format/output_file.h"
#include "player/bench.h"
#include "player/play.h"
#include "player/play_report.h"
#include "player/report_parts.h"
#include "player/row_file.h"
#include "player/run_row.h"
#include "player/stability.h"
#include "player/sweep.h"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <new>
#include <string>

namespace {

void print(const std::string& text)
{
    if (std::fputs(gsc::validUtf8(text).c_str(), stdout) < 0 || std::fflush(stdout) != 0)
        throw gsc::Error(gsc::ErrorCode::Io,
                         "standard output: cannot be written, expected room for the summary; redirect "
                         "it to another place");
}

// A summary, on standard error where standard output holds a file of the user's.
void printSummary(const std::string& text, const std::string& file, bool quiet)
{
    if (!gsc::isStandardOutput(file))
        print(text);
    else if (!quiet)
        (void)std::fputs(gsc::validUtf8(text).c_str(), stderr);
}

void runPlay(const gsc::PlayOptions& options)
{
    gsc::PlayLog log(options.progress, options.quiet, options.verbose);
    const gsc::PlaySummary summary = gsc::play(options, log);
    printSummary(options.format == gsc::ReportFormat::Json ? gsc::playReportJson(summary, log.warnings())
                                                           : gsc::playReportText(summary),
                 options.stats, options.quiet);
}

void runSweep(const gsc::BenchOptions& options)
{
    gsc::PlayLog log(options.play.progress, options.play.quiet, options.play.verbose);
    const bool text = options.play.format == gsc::ReportFormat::Text;
    bool first = true;
    gsc::sweep(options, log, [&](const gsc::OrderedJson& row) {
        log.endBar();
        if (text)
            printSummary((first ? gsc::runTableHeader() : "") + gsc::runTableLine(row), options.out,
                         options.play.quiet);
        else
            print(gsc::dumpJson(row) + "\n");
        first = false;
    });
}

// The exit code.
int runStability(const gsc::StabilityOptions& options)
{
    gsc::PlayLog log(options.play.progress, options.play.quiet, options.play.verbose);
    const gsc::StabilitySummary summary = gsc::stability(options, log);
    print(options.play.format == gsc::ReportFormat::Json ? gsc::stabilityReportJson(options, summary)
                                                         : gsc::stabilityReportText(options, summary));
    return int(summary.passed() ? gsc::ErrorCode::Ok : gsc::ErrorCode::Difference);
}

void runBench(const gsc::BenchOptions& options)
{
    gsc::PlayLog log(options.play.progress, options.play.quiet, options.play.verbose);
    const gsc::BenchSummary summary = gsc::bench(options, log);
    const std::string json = gsc::benchReportJson(options, summary);
    if (!options.out.empty())
        gsc::appendLine(options.out, json, gsc::kBenchRow.start);
    printSummary(options.play.format == gsc::ReportFormat::Json ? json + "\n" : gsc::benchReportText(options, summary),
                 options.out, options.play.quiet);
}

int fail(gsc::ErrorCode code, const gsc::PlayOptions& options, const char* message)
{
    std::fprintf(stderr, "error: %s\n", message);
    if (options.format == gsc::ReportFormat::Json)
        (void)std::fputs(gsc::errorReportJson(code, message).c_str(), stdout);
    return int(code);
}

struct Options {
    gsc::PlayOptions play;
    gsc::BenchOptions bench;
    gsc::StabilityOptions stability;
    const gsc::PlayOptions* chosen = &play; // those of the command
};

int run(int argc, char** argv, Options& options)
{
    // a file of such a name can be played as ./bench
    const std::string command = argc > 1 ? argv[1] : "";
    if (command == "bench") {
        options.chosen = &options.bench.play;
        if (const auto code = gsc::parseBenchOptions(argc - 1, argv + 1, options.bench))
            return *code;
        gsc::installFileFaultHandler(options.bench.play.format == gsc::ReportFormat::Json);
        options.bench.sweep.empty() ? runBench(options.bench) : runSweep(options.bench);
    } else if (command == "stability") {
        options.chosen = &options.stability.play;
        if (const auto code = gsc::parseStabilityOptions(argc - 1, argv + 1, options.stability))
            return *code;
        gsc::installFileFaultHandler(options.stability.play.format == gsc::ReportFormat::Json);
        return runStability(options.stability);
    } else {
        if (const auto code = gsc::parsePlayOptions(argc, argv, options.play))
            return *code;
        gsc::installFileFaultHandler(options.play.format == gsc::ReportFormat::Json);
        runPlay(options.play);
    }
    return int(gsc::ErrorCode::Ok);
}

} // namespace

int main(int argc, char** argv)
{
    gsc::installInterruptHandler();
    Options options;
    try {
        return run(argc, argv, options);
    } catch (const gsc::Error& e) {
        return fail(e.code(), *options.chosen, e.what());
    } catch (const std::bad_alloc&) {
        return fail(gsc::ErrorCode::OutOfMemory, *options.chosen,
                    "out of memory; try a smaller --size or fewer --threads");
    } catch (const std::exception& e) {
        return fail(gsc::ErrorCode::Internal, *options.chosen, e.what());
    }
}
