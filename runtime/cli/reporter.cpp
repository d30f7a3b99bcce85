// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/reporter.h"

#include <gsc/utf8.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/resource.h>
#include <unistd.h>

namespace gsc {

OrderedJson jsonNumber(double value)
{
    return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

std::string jsonText(const OrderedJson& json, int indent)
{
    return json.dump(indent, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string formatBytes(uint64_t bytes)
{
    static const char* const kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    double value = double(bytes);
    size_t unit = 0;
    while (value >= 1024 && unit + 1 < std::size(kUnits)) {
        value /= 1024;
        ++unit;
    }
    return unit == 0 ? formatString("%llu B", static_cast<unsigned long long>(bytes))
                     : formatString("%.*f %s",
                                    value < 9.995    ? 2
                                    : value < 999.95 ? 1
                                                     : 0,
                                    value, kUnits[unit]);
}

std::string formatMeasured(double value)
{
    const double size = std::abs(value);
    if (size >= 999.95 && size < 1e18)
        return (value < 0 ? "-" : "") + formatCount(uint64_t(std::llround(size)));
    return formatString("%.*f", size < 0.99995 ? 4 : size < 9.9995 ? 3 : size < 99.995 ? 2 : 1, value);
}

uint64_t peakMemoryBytes()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024; // Linux states ru_maxrss in KiB
}

Reporter::Reporter(const ReporterOptions& options)
    : m_options(options), m_progress(options.quiet ? ProgressMode::None : options.progress)
{
    const char* no_color = std::getenv("NO_COLOR"); // no-color.org: any value but the empty string
    m_shows_result = isatty(STDOUT_FILENO);
    m_color = !options.no_color && !(no_color && *no_color) && isatty(STDERR_FILENO);
}

void Reporter::text(const std::string& text)
{
    const std::string valid = validUtf8(text); // messages quote names of files, which may hold any bytes
    const std::lock_guard lock(m_saying);
    if (m_shows_result)
        m_progress.clearBar();
    std::fwrite(valid.data(), 1, valid.size(), stdout);
    if (text.empty() || text.back() != '\n')
        std::fputc('\n', stdout);
    if (m_shows_result)
        std::fflush(stdout); // before the bar is drawn again
}

void Reporter::object(const OrderedJson& json)
{
    text(jsonText(json));
}

void Reporter::line(const char* level, const char* color, const std::string& message)
{
    const std::lock_guard lock(m_saying);
    m_progress.clearBar();
    if (m_options.progress == ProgressMode::Json) {
        std::fprintf(stderr, "%s\n", jsonText({{"event", level}, {"message", message}}, -1).c_str());
        return;
    }
    if (color == nullptr)
        std::fprintf(stderr, message.ends_with('\n') ? "%s" : "%s\n", validUtf8(message).c_str());
    else if (m_color)
        std::fprintf(stderr, "\033[%sm%s:\033[0m %s\n", color, level, validUtf8(message).c_str());
    else
        std::fprintf(stderr, "%s: %s\n", level, validUtf8(message).c_str());
}

void Reporter::error(const std::string& message)
{
    line("error", "1;31", message);
}

void Reporter::warning(const std::string& message)
{
    {
        const std::lock_guard lock(m_saying);
        m_warnings.push_back(message);
    }
    if (!m_options.quiet)
        line("warning", "1;33", message);
}

void Reporter::detail(const std::string& message)
{
    if (m_options.verbose > 0 && !m_options.quiet)
        line("info", "36", message);
}

void Reporter::tell(const std::string& message)
{
    if (!m_options.quiet)
        line("info", nullptr, message);
}

void Reporter::done(const std::string& what)
{
    endProgress(false);
    if (m_options.quiet)
        return;
    if (m_options.progress == ProgressMode::Json)
        std::fprintf(stderr, "%s\n",
                     jsonText({{"event", "finished"},
                               {"message", what},
                               {"elapsedMs", uint64_t(1000 * seconds())},
                               {"peakMemoryBytes", peakMemoryBytes()}},
                              -1)
                         .c_str());
    else
        std::fprintf(stderr, "%s in %.1f s, peak memory %s\n", validUtf8(what).c_str(), seconds(),
                     formatBytes(peakMemoryBytes()).c_str());
}

void Reporter::progress(const char* stage, uint64_t finished, uint64_t total)
{
    const std::lock_guard lock(m_saying);
    m_progress.update(stage, finished, total);
}

void Reporter::progressPart(const std::string& part)
{
    const std::lock_guard lock(m_saying);
    m_progress.setPart(part);
}

void Reporter::endProgress(bool failed)
{
    const std::lock_guard lock(m_saying);
    m_progress.close(failed);
}

void Reporter::flush()
{
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
        throw Error(ErrorCode::Io, "standard output", formatString("cannot be written (%s)", std::strerror(errno)),
                    "room for the result", "redirect it to another place");
}

} // namespace gsc
