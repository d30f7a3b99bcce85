// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/row_file.h"

#include "format/error.h"
#include "format/file/output_file.h"
#include "player/report/report_parts.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace gsc {

const RowKind kBenchRow{R"({"schema":"gsc.bench/)", "a bench", "\"gsc.bench/1\" (schemas/bench-report.schema.json)"};

namespace {

[[noreturn]] void failLine(const std::string& path, size_t line, const RowKind& kind)
{
    throw Error(ErrorCode::InvalidFile, formatString("%s: line %zu is no row of %s, expected %s; choose another --out",
                                                     path.c_str(), line, kind.command, kind.expected));
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
        if (!startsAsRow(text, kind)) // a model may have many gigabytes
            failLine(path, 1, kind);
    }
    if (!file || std::ferror(file.get()))
        throw Error(ErrorCode::Io,
                    formatString("%s: cannot be read (%s), expected rows of %s or nothing; choose another "
                                 "--out",
                                 path.c_str(), std::strerror(errno), kind.command));
    return text;
}

bool isBenchRow(const OrderedJson& row)
{
    const auto schema = row.find("schema");
    if (schema == row.end() || !schema->is_string())
        return false;
    const std::string version = schema->get<std::string>().substr(std::strlen("gsc.bench/"));
    return !version.empty() && version.find_first_not_of("0123456789") == std::string::npos;
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
        const OrderedJson row = OrderedJson::parse(content, nullptr, false);
        if (!content.starts_with(kind.start) || !row.is_object() || !take(row))
            failLine(path, line, kind);
    }
    const std::string_view rest = std::string_view(text).substr(file.whole);
    if (rest.empty())
        return file;
    const OrderedJson row = OrderedJson::parse(rest, nullptr, false);
    file.needs_end = !row.is_discarded(); // such as where an editor or a copy left the end out
    // only what is the start of a row for certain is thrown away
    if (file.needs_end ? !rest.starts_with(kind.start) || !take(row) : !isCutLine(rest, kind.start))
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

RowFile readBenchRows(const std::string& path)
{
    RowFile file = readRows(path, kBenchRow, isBenchRow);
    if (!file.cut_off.empty())
        file.cut_off.resize(file.cut_off.rfind(" and")); // a bench does not look for runs that are missing
    return file;
}

void checkRowOutput(const BenchOptions& options, std::vector<NamedPath> inputs, bool json_summary)
{
    if (options.out.empty())
        return;
    inputs.push_back({options.play.input, "the model"});
    const NamedPath out{options.out, "--out"};
    checkOutputsDiffer(std::span(&out, 1), inputs);
    checkStandardOutput(options.out, "--out", json_summary);
    checkAppend(options.out);
}

} // namespace gsc
