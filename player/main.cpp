// SPDX-License-Identifier: Apache-2.0
#include "format/error.h"
#include "format/interrupt.h"
#include "player/play.h"
#include "player/play_report.h"

#include <cstdio>
#include <new>

namespace {

gsc::ErrorCode run(const gsc::PlayOptions& options)
{
    gsc::PlayLog log(options.progress, options.quiet, options.verbose);
    const gsc::PlaySummary summary = gsc::play(options, log);
    const std::string text = options.format == gsc::ReportFormat::Json ? gsc::playReportJson(summary, log.warnings())
                                                                       : gsc::playReportText(summary);
    if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
        throw gsc::Error(gsc::ErrorCode::Io,
                         "standard output: cannot be written, expected room for the summary; redirect "
                         "it to another place");
    return gsc::ErrorCode::Ok;
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
    gsc::PlayOptions options;
    try {
        if (const auto code = gsc::parsePlayOptions(argc, argv, options))
            return *code;
        return int(run(options));
    } catch (const gsc::Error& e) {
        return fail(e.code(), options, e.what());
    } catch (const std::bad_alloc&) {
        return fail(gsc::ErrorCode::OutOfMemory, options, "out of memory; try a smaller --size or fewer --threads");
    } catch (const std::exception& e) {
        return fail(gsc::ErrorCode::Internal, options, e.what());
    }
}
