// SPDX-License-Identifier: Apache-2.0
// Log of a headset's frames: writes a line for each frame to a file, and keeps sums over the session.
#pragma once

#include "runtime/cli/json_lines.h"
#include "player/xr/xr.h"

namespace gsc {

class XrLog {
public:
    // opens the log file; throws as JsonLines does
    XrLog(const std::string& path, bool overwrite) : m_file(path, overwrite) {}

    void add(const XrFrame& frame);  // writes the line at once. Throws Error(Io)
    void close() { m_file.close(); } // ends the file; later frames count in the sums only
    void sumUp(XrSummary& summary) const;

private:
    JsonLines m_file;
    uint64_t m_frames = 0, m_visible = 0, m_untracked = 0, m_missed = 0, m_pictures = 0;
    std::vector<double> m_ages, m_off, m_busy, m_latency;
};

} // namespace gsc
