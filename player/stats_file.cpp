// SPDX-License-Identifier: Apache-2.0
#include "player/stats_file.h"

#include "format/error.h"

#include <cerrno>
#include <cstring>

#include <unistd.h>

namespace gsc {

StatsFile::StatsFile(const std::string& path) : m_path(path)
{
    if (path.empty())
        return;
    m_temporary = formatString("%s.tmp%ld", path.c_str(), static_cast<long>(getpid()));
    m_file = std::fopen(m_temporary.c_str(), "wb");
    if (!m_file) {
        m_temporary.clear();
        fail();
    }
}

StatsFile::~StatsFile()
{
    if (m_file)
        (void)std::fclose(m_file);
    if (!m_temporary.empty())
        (void)std::remove(m_temporary.c_str());
}

void StatsFile::fail() const
{
    throw Error(ErrorCode::Io, formatString("%s: cannot be written (%s), expected a place with room; check the path of "
                                            "--stats, its rights and the free space",
                                            m_path.c_str(), std::strerror(errno)));
}

void StatsFile::add(const FrameStats& stats)
{
    if (!m_file)
        return;
    const std::string line = frameStatsJson(stats) + "\n";
    if (std::fwrite(line.data(), 1, line.size(), m_file) != line.size())
        fail();
}

void StatsFile::finish()
{
    if (!m_file)
        return;
    const int closed = std::fclose(m_file);
    m_file = nullptr;
    if (closed != 0 || std::rename(m_temporary.c_str(), m_path.c_str()) != 0)
        fail();
    m_temporary.clear();
}

} // namespace gsc
