// SPDX-License-Identifier: Apache-2.0
// What a command says: its result on stdout, everything else on stderr.
#pragma once

#include "convert/commands/progress.h"
#include "format/error.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

namespace gsc {

enum class ReportFormat { Text, Json };

struct ReporterOptions {
    ReportFormat format = ReportFormat::Text;
    ProgressMode progress = ProgressMode::Auto;
    bool quiet = false;
    int verbose = 0;
    bool no_color = false;
};

using Json = nlohmann::ordered_json; // keys come out in the order they were written

// A number JSON can hold: null where the value is not finite.
Json jsonNumber(double value);
// Pretty text of a report; source strings that are not UTF-8 are repaired, never thrown on.
std::string jsonText(const Json& json);
// 1536 -> "1.5 KiB", three significant digits or so.
std::string formatBytes(uint64_t bytes);
// 1234567 -> "1,234,567".
std::string formatCount(uint64_t count);
// Largest resident set of this process so far, bytes.
uint64_t peakMemoryBytes();
std::string versionText();

class Reporter {
public:
    explicit Reporter(const ReporterOptions& options);

    [[nodiscard]] const ReporterOptions& options() const { return m_options; }
    [[nodiscard]] bool json() const { return m_options.format == ReportFormat::Json; }
    [[nodiscard]] double seconds() const { return m_progress.seconds(); } // since construction

    // stdout. Exactly one of the two is used, according to the format asked for. Throws Error(Io).
    void text(const std::string& text);
    void object(const Json& json);

    // stderr
    void error(const std::string& message);
    void warning(const std::string& message);
    void detail(const std::string& message); // shown with -v
    void note(const std::string& text);      // a result whose place on stdout a file has taken
    // Closing line of a command that worked: `what`, time, peak memory.
    void done(const std::string& what);

    void progress(const char* stage, uint64_t finished, uint64_t total);
    void endProgress(bool failed);

    // Throws Error(Io) if something written to stdout did not arrive (full disk, closed pipe).
    void flush();

private:
    void line(const char* level, const char* color, const std::string& message);

    ReporterOptions m_options;
    Progress m_progress;
    bool m_color = false;
};

} // namespace gsc
