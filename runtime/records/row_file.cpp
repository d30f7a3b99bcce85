// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/row_file.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include "format/file/stand_in.h"
#include "runtime/records/record.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace gsc {

namespace {

[[noreturn]] void failLine(const std::string& path, size_t line, const RowKind& kind, const std::string& fault = {})
{
    throw Error(ErrorCode::InvalidFile, path,
                formatString("line %zu is no row of %s%s", line, kind.command,
                             fault.empty() ? "" : (" (" + fault + ")").c_str()),
                kind.expected, formatString("choose another %s", kind.option));
}

// Does `text` start as a row does, as far as both go?
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
        if (!startsAsRow(text, kind)) { // a model may have many gigabytes
            refuseStandIn(text, path);
            failLine(path, 1, kind);
        }
    }
    if (!file || std::ferror(file.get()))
        throw Error(ErrorCode::Io, path, formatString("cannot be read (%s)", std::strerror(errno)),
                    formatString("rows of %s or nothing", kind.command),
                    formatString("choose another %s", kind.option));
    return text;
}

} // namespace

RowFile readRows(const std::string& path, const RowKind& kind, const std::function<bool(const OrderedJson&)>& take)
{
    RowFile file;
    if (path.empty() || isStandardOutput(path))
        return file;
    const std::string text = readAll(path, kind);
    file.bytes = text.size();
    size_t line = 1;
    for (size_t end = 0; (end = text.find('\n', file.whole)) != std::string::npos; ++line, file.whole = end + 1) {
        const std::string_view content(text.data() + file.whole, end - file.whole);
        if (!content.starts_with(kind.start))
            failLine(path, line, kind);
        const ParsedRow row = parseRow(content);
        if (row.state == ParsedRow::State::BeyondLimits)
            failLine(path, line, kind, row.fault);
        if (!row.json.is_object() || !take(row.json))
            failLine(path, line, kind);
    }
    const std::string_view rest = std::string_view(text).substr(file.whole);
    if (rest.empty())
        return file;
    const ParsedRow row = parseRow(rest);
    if (row.state == ParsedRow::State::BeyondLimits)
        failLine(path, line, kind, row.fault);
    file.needs_end = row.state == ParsedRow::State::Whole; // such as where an editor or a copy left the end out
    // only what is the start of a row for certain is thrown away
    if (file.needs_end ? !rest.starts_with(kind.start) || !take(row.json) : !isCutLine(rest, kind.start))
        failLine(path, line, kind);
    if (file.needs_end)
        file.whole = file.bytes;
    else
        file.cut_off =
            formatString("%s: line %zu is half-written, what a run that was killed left behind; it is cut off "
                         "and that run is done again",
                         path.c_str(), line);
    return file;
}

void addRow(const std::string& path, const RowKind& kind, std::string_view line)
{
    appendLine(path, line, kind.start, [](std::string_view tail) { return OrderedJson::accept(tail); });
}

void checkUntouched(const std::string& path, uint64_t bytes, const RowKind& kind)
{
    std::error_code code;
    const bool is_file = !path.empty() && !isStandardOutput(path) && std::filesystem::exists(path, code);
    const uint64_t found = is_file ? std::filesystem::file_size(path, code) : 0;
    if (is_file && !code && found != bytes)
        throw Error(ErrorCode::Io, path, formatString("has %llu bytes", static_cast<unsigned long long>(found)),
                    formatString("the %llu that were there before: another program writes to it",
                                 static_cast<unsigned long long>(bytes)),
                    formatString("give every run %s of its own", kind.option));
}

} // namespace gsc
