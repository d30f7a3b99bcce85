// SPDX-License-Identifier: Apache-2.0
// The file of --stats: one JSON object per line, there only when complete; or standard output.
#pragma once

#include "format/file/output_file.h"
#include "runtime/frame_stats.h"

#include <optional>
#include <string>

namespace gsc {

class StatsFile {
public:
    // An empty path makes every call do nothing. Throws Error as OutputFile, as all do.
    StatsFile(const std::string& path, bool overwrite);

    void add(const FrameStats& stats);
    void finish();

private:
    std::optional<OutputFile> m_file;
};

} // namespace gsc
