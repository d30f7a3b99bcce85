// SPDX-License-Identifier: Apache-2.0
// The file of --stats: one JSON object per line, there only when complete.
#pragma once

#include "runtime/frame_stats.h"

#include <cstdio>
#include <string>

namespace gsc {

class StatsFile {
public:
    // An empty path makes every call do nothing. Throws Error(Io), as all do.
    explicit StatsFile(const std::string& path);
    ~StatsFile(); // removes the temporary file unless finish() succeeded
    StatsFile(const StatsFile&) = delete;
    StatsFile& operator=(const StatsFile&) = delete;

    void add(const FrameStats& stats);
    void finish();

private:
    [[noreturn]] void fail() const;

    std::string m_path, m_temporary;
    std::FILE* m_file = nullptr;
};

} // namespace gsc
