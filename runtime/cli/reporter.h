// SPDX-License-Identifier: Apache-2.0
// Output of a command: the result on stdout, everything else on stderr.
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

// Formats bytes with three or four significant digits: 1536 becomes "1.50 KiB".
std::string formatBytes(uint64_t bytes);
// Formats a measured value for columns, with four significant digits and at most four decimals: 0.0123, 12.35, 1,235.
std::string formatMeasured(double value);
// Returns the largest resident set of this process so far, in bytes.
uint64_t peakMemoryBytes();

// Writes the output of a command. The functions that write to stderr may be called from several threads.
class Reporter {
public:
    explicit Reporter(const ReporterOptions& options);

    [[nodiscard]] const ReporterOptions& options() const { return m_options; }
    [[nodiscard]] bool json() const { return m_options.format == ReportFormat::Json; }
    [[nodiscard]] double seconds() const { return m_progress.seconds(); } // seconds since the Reporter was made

    // Write the result to stdout: text() or object(), according to the format asked for. Both throw Error(Io).
    void text(const std::string& text);
    void object(const OrderedJson& json);

    // Functions that write to stderr; with --progress json each call writes one event
    // (schemas/progress-event.schema.json).
    void error(const std::string& message);
    void warning(const std::string& message);
    void detail(const std::string& message); // prints a message if -v is given
    void tell(const std::string& message);   // prints a message unless -q is given
    // Prints the last line of a successful command: `what`, time and peak memory.
    void done(const std::string& what);

    void progress(const char* stage, uint64_t finished, uint64_t total);
    // Sets a text that is shown beside the stage, such as "run 3/12"; empty = none.
    void progressPart(const std::string& part);
    void endProgress(bool failed);

    // Returns all warnings so far for the report, also those that -q hid. Call it when no thread warns any more.
    [[nodiscard]] const std::vector<std::string>& warnings() const { return m_warnings; }

    // Throws Error(Io) if something written to stdout was lost (full disk, closed pipe).
    void flush();

private:
    void line(const char* level, const char* color, const std::string& message);

    ReporterOptions m_options;
    StageProgress m_progress;
    bool m_color = false, m_shows_result = false; // m_shows_result: stdout is a terminal, perhaps that of the bar
    std::mutex m_saying;
    std::vector<std::string> m_warnings;
};

} // namespace gsc
