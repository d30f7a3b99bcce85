// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/row_file.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include "format/numbers/count_text.h"
#include "format/file/stand_in.h"
#include "runtime/records/row_lines.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

std::string placeOf(const std::string& path, size_t line)
{
    return formatString("%s:%zu", path.c_str(), line);
}

[[noreturn]] void failLine(const std::string& path, size_t line, const RowKind& kind, std::string_view text,
                           const std::string& fault = {})
{
    if (&kind == &kRunRow)
        refuseOtherVersion(text, placeOf(path, line));
    throw Error(ErrorCode::InvalidFile, path,
                formatString("line %zu is no row of %s%s", line, kind.command,
                             fault.empty() ? "" : (" (" + fault + ")").c_str()),
                kind.expected, formatString("choose another %s", kind.option));
}

// True if `text` and the start of a row agree, over the length of the shorter.
bool startsAsRow(std::string_view text, const RowKind& kind)
{
    const size_t known = std::min(text.size(), kind.start.size());
    return text.substr(0, known) == kind.start.substr(0, known);
}

std::string readAll(const std::string& path, const RowKind& kind)
{
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    if (!file && errno == ENOENT)
        return {};
    std::string text;
    char buffer[65536];
    size_t count = 0;
    while (file && (count = std::fread(buffer, 1, sizeof(buffer), file.get())) > 0) {
        text.append(buffer, count);
        if (!startsAsRow(text, kind)) { // refused before the rest is read: a model may have many gigabytes
            refuseStandIn(text, path);
            failLine(path, 1, kind, text);
        }
    }
    if (!file || std::ferror(file.get()))
        throw Error(ErrorCode::Io, path, formatString("cannot be read (%s)", std::strerror(errno)),
                    formatString("rows of %s or nothing", kind.command),
                    formatString("choose another %s", kind.option));
    return text;
}

} // namespace

const RowKind kRunRow{R"({"schema":"gsc.run/2",)", "a measurement", "\"gsc.run/2\" (schemas/run.schema.json)"};

RowFile::RowFile(std::string path, const RowKind& kind, const Take& take) : m_path(std::move(path)), m_kind(&kind)
{
    if (!m_path.empty() && !isStandardOutput(m_path))
        read(readAll(m_path, kind), take);
}

void RowFile::read(const std::string& text, const Take& take)
{
    m_bytes = text.size();
    size_t line = 1;
    for (size_t end = 0; (end = text.find('\n', m_whole)) != std::string::npos; ++line, m_whole = end + 1) {
        const std::string_view content(text.data() + m_whole, end - m_whole);
        if (!content.starts_with(m_kind->start))
            failLine(m_path, line, *m_kind, content);
        const ParsedRow row = parseRow(content);
        if (row.state == ParsedRow::State::BeyondLimits)
            failLine(m_path, line, *m_kind, content, row.fault);
        if (!row.json.is_object())
            failLine(m_path, line, *m_kind, content);
        take(row.json, placeOf(m_path, line));
    }
    const std::string_view rest = std::string_view(text).substr(m_whole);
    if (rest.empty())
        return;
    const ParsedRow row = parseRow(rest);
    if (row.state == ParsedRow::State::BeyondLimits)
        failLine(m_path, line, *m_kind, rest, row.fault);
    if (row.state == ParsedRow::State::Whole) { // an editor may leave out the last line end
        if (!rest.starts_with(m_kind->start) || !row.json.is_object())
            failLine(m_path, line, *m_kind, rest);
        take(row.json, placeOf(m_path, line));
        m_whole = m_bytes + 1; // the next row writes the missing line end
        return;
    }
    if (!isCutLine(rest, m_kind->start)) // thrown away only if it is certainly the start of a row
        failLine(m_path, line, *m_kind, rest);
    m_cut_off = formatString("%s: line %zu is half-written, what a run that was killed left behind; it is cut off",
                             m_path.c_str(), line);
}

void RowFile::add(std::string_view line)
{
    if (m_path.empty())
        return;
    std::error_code code;
    const bool is_file = !isStandardOutput(m_path) && std::filesystem::exists(m_path, code);
    const uint64_t found = is_file ? std::filesystem::file_size(m_path, code) : 0;
    if (is_file && !code && found != m_bytes)
        throw Error(
            ErrorCode::Io, m_path, "has " + formatCount(found, "byte"),
            formatString("the %s that were there before: another program writes to it", formatCount(m_bytes).c_str()),
            formatString("give every run %s of its own", m_kind->option));
    addRow(m_path, *m_kind, line);
    m_whole += line.size() + 1;
    m_bytes = m_whole;
}

void addRow(const std::string& path, const RowKind& kind, std::string_view line)
{
    appendLine(path, line, kind.start, [](std::string_view tail) { return OrderedJson::accept(tail); });
}

} // namespace gsc
