// SPDX-License-Identifier: Apache-2.0
// Output of a command: its result on stdout, everything else on stderr.
#pragma once

#include <gsc/error.h>
#include "format/numbers/count_text.h"
#include "runtime/cli/json.h"
#include "runtime/cli/stage_progress.h"

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace gsc {

enum class ReportFormat { Text, Json };

struct ReporterOptions {
    ReportFormat format = ReportFormat::Text;
    ProgressMode progress = ProgressMode::Auto;
    bool quiet = false;
    int verbose = 0;
    bool no_color = false;
};

// 1536 -> "1.50 KiB", three or four significant digits.
std::string formatBytes(uint64_t bytes);
// A measured value with four significant digits and at most four decimals, for columns: 0.0123, 12.35, 1,235.
std::string formatMeasured(double value);
// Largest resident set of this process so far, bytes.
uint64_t peakMemoryBytes();

// Output of a command. Functions that write to stderr may be called from several threads.
class Reporter {
public:
    explicit Reporter(const ReporterOptions& options);

    [[nodiscard]] const ReporterOptions& options() const { return m_options; }
    [[nodiscard]] bool json() const { return m_options.format == ReportFormat::Json; }
    [[nodiscard]] double seconds() const { return m_progress.seconds(); } // since construction

    // stdout. Exactly one of the two is used, according to the format asked for. Throws Error(Io).
    void text(const std::string& text);
    void object(const OrderedJson& json);

    // stderr; with --progress json each is one event (schemas/progress-event.schema.json)
    void error(const std::string& message);
    void warning(const std::string& message);
    void detail(const std::string& message); // shown with -v
    void tell(const std::string& message);   // shown unless -q
    // Closing line of a command that worked: `what`, time, peak memory.
    void done(const std::string& what);

    void progress(const char* stage, uint64_t finished, uint64_t total);
    // Text beside the stage for a person, such as "run 3/12"; empty = nothing.
    void progressPart(const std::string& part) { m_progress.setPart(part); }
    void endProgress(bool failed);

    // Every warning so far, for the report, also those that -q did not show. Call when no thread warns any more.
    [[nodiscard]] const std::vector<std::string>& warnings() const { return m_warnings; }

    // Throws Error(Io) if something written to stdout did not arrive (full disk, closed pipe).
    void flush();

private:
    void line(const char* level, const char* color, const std::string& message);

    ReporterOptions m_options;
    StageProgress m_progress;
    bool m_color = false;
    std::mutex m_saying;
    std::vector<std::string> m_warnings;
};

} // namespace gsc
