// SPDX-License-Identifier: Apache-2.0
#include "player/window/window_log.h"

#include "format/error.h"
#include "format/file/output_paths.h"
#include "player/tool/json.h"

#include <cerrno>

namespace gsc {

// note: no temporary file, as elsewhere: whoever follows the window reads the lines while it is open
WindowLog::WindowLog(const std::string& path, bool overwrite) : m_path(path)
{
    if (path.empty())
        return;
    checkOutput(path, OutputKind::Binary, overwrite);
    m_file = std::fopen(path.c_str(), "w");
    if (m_file == nullptr)
        failOutput(path, "cannot be opened", errno);
}

WindowLog::~WindowLog()
{
    if (m_file != nullptr)
        std::fclose(m_file);
}

void WindowLog::add(const WindowFrame& frame)
{
    if (m_file == nullptr)
        return;
    const bool compares = frame.shows != "picture";
    const OrderedJson line = {
        {"frame", frame.frame},
        {"seconds", frame.seconds},
        {"pose", frame.pose},
        {"asked", frame.asked},
        {"keys", frame.keys},
        {"size", {frame.width, frame.height}},
        {"refresh_ms", frame.refresh_ms},
        {"latency_ms", frame.latency_ms},
        {"position", frame.position},
        {"shows", frame.shows},
        {"psnr", compares ? jsonNumber(frame.psnr) : OrderedJson()},
        {"flip", compares && frame.flip >= 0 ? OrderedJson(frame.flip) : OrderedJson()},
        {"wrote", frame.wrote.empty() ? OrderedJson() : OrderedJson(frame.wrote)},
        {"said", frame.said.empty() ? OrderedJson() : OrderedJson(frame.said)},
    };
    const std::string text = jsonText(line, -1) + "\n";
    if (std::fwrite(text.data(), 1, text.size(), m_file) != text.size() || std::fflush(m_file) != 0)
        failOutput(m_path, "cannot be written", errno);
}

} // namespace gsc
