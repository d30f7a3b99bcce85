// SPDX-License-Identifier: Apache-2.0
#include "player/report/stats_file.h"

namespace gsc {

StatsFile::StatsFile(const std::string& path, bool overwrite)
{
    if (!path.empty())
        m_file.emplace(path, OutputKind::Text, overwrite);
}

void StatsFile::add(const FrameStats& stats)
{
    if (m_file)
        m_file->write(frameStatsJson(stats) + "\n");
}

void StatsFile::finish()
{
    if (m_file)
        m_file->commit();
}

} // namespace gsc
