// SPDX-License-Identifier: Apache-2.0
// What happened in each frame of a headset: lines in a file, and the sums of a whole run.
#pragma once

#include "player/xr/xr.h"

#include <cstdio>

namespace gsc {

class XrLog {
public:
    XrLog(const std::string& path, bool overwrite); // empty = no file. Throws Error(Io)
    ~XrLog();
    XrLog(const XrLog&) = delete;
    XrLog& operator=(const XrLog&) = delete;

    void add(const XrFrame& frame); // its line is in the file at once. Throws Error(Io)
    void close();                   // the file takes no more
    void sumUp(XrSummary& summary) const;

private:
    std::string m_path;
    std::FILE* m_file = nullptr;
    uint64_t m_frames = 0, m_visible = 0, m_untracked = 0, m_missed = 0, m_pictures = 0;
    std::vector<double> m_ages, m_off, m_busy, m_latency;
};

} // namespace gsc
