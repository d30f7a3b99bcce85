// SPDX-License-Identifier: Apache-2.0
#include "log.h"

#include <cstdarg>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace gsc::fake_xr {

std::string formatString(const char* format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    std::string text(size_t(std::vsnprintf(nullptr, 0, format, args)), '\0');
    std::vsnprintf(text.data(), text.size() + 1, format, again);
    va_end(again);
    va_end(args);
    return text;
}

std::string quoted(const std::string& text)
{
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void Log::open(const std::string& path)
{
    if (path == m_path)
        return;
    m_file.reset(path.empty() ? nullptr : std::fopen(path.c_str(), "w"));
    m_path = path;
    if (!path.empty() && !m_file)
        throw std::runtime_error(path + ": the log cannot be written");
}

void Log::line(const std::string& json)
{
    if (!m_file)
        return;
    std::fprintf(m_file.get(), "%s\n", json.c_str());
    std::fflush(m_file.get());
}

} // namespace gsc::fake_xr
