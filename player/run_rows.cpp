// SPDX-License-Identifier: Apache-2.0
#include "player/run_rows.h"

#include "format/error.h"
#include "player/bench.h"
#include "player/report_parts.h"
#include "player/run_row.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

// How every line of dumpJson() of a row starts.
constexpr std::string_view kRowStart = R"({"schema":"gsc.run/1",)";

std::string readAll(const std::string& path)
{
    std::error_code code;
    if (!std::filesystem::exists(path, code))
        return {};
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    std::string text;
    char buffer[65536];
    size_t count = 0;
    while (file && (count = std::fread(buffer, 1, sizeof(buffer), file.get())) > 0)
        text.append(buffer, count);
    if (!file || std::ferror(file.get()))
        throw Error(ErrorCode::Io, formatString("%s: cannot be read (%s), expected the rows of an earlier sweep or "
                                                "nothing; choose another --out",
                                                path.c_str(), std::strerror(errno)));
    return text;
}

[[noreturn]] void failLine(const std::string& path, size_t line)
{
    throw Error(ErrorCode::InvalidFile,
                formatString("%s: line %zu is no row of a sweep, expected \"gsc.run/1\" (schemas/run.schema.json) with "
                             "the numbers of this version; choose another --out",
                             path.c_str(), line));
}

// Has a row what a sweep that goes on needs of it?
bool isRow(const OrderedJson& row)
{
    try {
        if (row.at("schema") != "gsc.run/1" || !row.at("config").at("id").is_string())
            return false;
        const OrderedJson& decoded = row.at("per_frame").at("decoded");
        if (!decoded.is_array() || decoded.empty() || !row.at("config").at("eyes").is_number_integer() ||
            row.at("config").at("eyes").get<int>() < 1)
            return false;
        (void)runTableLine(row);
        return std::all_of(decoded.begin(), decoded.end(), [](const OrderedJson& v) { return v.is_number(); });
    } catch (const OrderedJson::exception&) {
        return false;
    }
}

} // namespace

RunRows::RunRows(const std::string& path, std::string& cut_off) : m_path(path)
{
    cut_off.clear();
    if (path.empty())
        return;
    const std::string text = readAll(path);
    m_size = text.size();
    size_t line = 1;
    for (size_t end = 0; (end = text.find('\n', m_bytes)) != std::string::npos; ++line, m_bytes = end + 1) {
        const std::string_view content(text.data() + m_bytes, end - m_bytes);
        OrderedJson row = OrderedJson::parse(content, nullptr, false);
        if (!isRow(row))
            failLine(path, line);
        insert(std::move(row));
    }
    const std::string_view rest = std::string_view(text).substr(m_bytes);
    if (rest.empty())
        return;
    // only what is the start of a row for certain is thrown away
    const size_t known = std::min(rest.size(), kRowStart.size());
    if (rest.substr(0, known) != kRowStart.substr(0, known))
        failLine(path, line);
    cut_off = formatString("%s: line %zu is half-written, what a run that was killed left behind; it is cut off and "
                           "that run is done again",
                           path.c_str(), line);
}

const OrderedJson* RunRows::find(const std::string& id) const
{
    const auto found = m_rows.find(id);
    return found == m_rows.end() ? nullptr : &found->second;
}

void RunRows::insert(OrderedJson row)
{
    const std::string id = row.at("config").at("id").get<std::string>();
    m_rows.insert_or_assign(id, std::move(row));
}

void RunRows::append(const OrderedJson& row)
{
    if (!m_path.empty()) {
        const std::string line = dumpJson(row);
        std::error_code code, ignored;
        const uint64_t size = std::filesystem::exists(m_path, ignored) ? std::filesystem::file_size(m_path, code) : 0;
        if (!code && size != m_size)
            throw Error(ErrorCode::Io,
                        formatString("%s: has %llu bytes, expected the %llu that were there before: another program "
                                     "writes to it; give every sweep an --out of its own",
                                     m_path.c_str(), static_cast<unsigned long long>(size),
                                     static_cast<unsigned long long>(m_size)));
        if (!code && m_size > m_bytes)
            std::filesystem::resize_file(m_path, m_bytes, code);
        if (code)
            throw Error(ErrorCode::Io, formatString("%s: cannot be cut to its whole lines: %s", m_path.c_str(),
                                                    code.message().c_str()));
        m_size = m_bytes;
        try {
            appendLine(m_path, line);
        } catch (const Error&) {
            std::filesystem::resize_file(m_path, m_bytes, ignored);
            throw;
        }
        m_bytes += line.size() + 1;
        m_size = m_bytes;
    }
    insert(row);
}

} // namespace gsc
