// SPDX-License-Identifier: Apache-2.0
// Log of a headset's frames: a line of a file for each, and the sums of a whole run.
#pragma once

#include "runtime/cli/json_lines.h"
#include "player/xr/xr.h"

namespace gsc {

class XrLog {
public:
    XrLog(const std::string& path, bool overwrite) : m_file(path, overwrite) {} // as JsonLines

    void add(const XrFrame& frame);  // its line is in the file at once. Throws Error(Io)
    void close() { m_file.close(); } // the sums go on
    void sumUp(XrSummary& summary) const;

private:
    JsonLines m_file;
    uint64_t m_frames = 0, m_visible = 0, m_untracked = 0, m_missed = 0, m_pictures = 0;
    std::vector<double> m_ages, m_off, m_busy, m_latency;
};

} // namespace gsc
