// SPDX-License-Identifier: Apache-2.0
#include "format/error.h"
#include "format/interrupt.h"
#include "player/bench.h"
#include "player/play.h"
#include "player/play_report.h"

#include <cstdio>
#include <cstring>
#include <new>

namespace {

void print(const std::string& text)
{
    if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
        throw gsc::Error(gsc::ErrorCode::Io,
                         "standard output: cannot be written, expected room for the summary; redirect "
                         "it to another place");
}

void runPlay(const gsc::PlayOptions& options)
{
    gsc::PlayLog log(options.progress, options.quiet, options.verbose);
    const gsc::PlaySummary summary = gsc::play(options, log);
    print(options.format == gsc::ReportFormat::Json ? gsc::playReportJson(summary, log.warnings())
                                                    : gsc::playReportText(summary));
}

void runBench(const gsc::BenchOptions& options)
{
    gsc::PlayLog log(options.play.progress, options.play.quiet, options.play.verbose);
    const gsc::BenchSummary summary = gsc::bench(options, log);
    const std::string json = gsc::benchReportJson(options, summary);
    if (!options.out.empty())
        gsc::appendLine(options.out, json);
    print(options.play.format == gsc::ReportFormat::Json ? json + "\n" : gsc::benchReportText(options, summary));
}

int fail(gsc::ErrorCode code, const gsc::PlayOptions& options, const char* message)
{
    std::fprintf(stderr, "error: %s\n", message);
    if (options.format == gsc::ReportFormat::Json)
        (void)std::fputs(gsc::errorReportJson(code, message).c_str(), stdout);
    return int(code);
}

} // namespace

int main(int argc, char** argv)
{
    gsc::installInterruptHandler();
    gsc::BenchOptions bench;
    gsc::PlayOptions& options = bench.play;
    try {
        // a file of that name can be played as ./bench
        const bool is_bench = argc > 1 && std::strcmp(argv[1], "bench") == 0;
        if (const auto code = is_bench ? gsc::parseBenchOptions(argc - 1, argv + 1, bench)
                                       : gsc::parsePlayOptions(argc, argv, options))
            return *code;
        is_bench ? runBench(bench) : runPlay(options);
        return int(gsc::ErrorCode::Ok);
    } catch (const gsc::Error& e) {
        return fail(e.code(), options, e.what());
    } catch (const std::bad_alloc&) {
        return fail(gsc::ErrorCode::OutOfMemory, options, "out of memory; try a smaller --size or fewer --threads");
    } catch (const std::exception& e) {
        return fail(gsc::ErrorCode::Internal, options, e.what());
    }
}
