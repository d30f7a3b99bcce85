// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/trace_set.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <filesystem>
#include <utility>

namespace gsc {

namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr size_t kSchemaWithin = 1000; // bytes from the start

OrderedJson parsedTrace(std::string_view text, const std::string& where)
{
    ParsedRow parsed = parseRow(text);
    if (parsed.state != ParsedRow::State::Whole)
        throw Error(ErrorCode::InvalidFile, where + ": " + parsed.fault +
                                                ", expected one trace per line as gsc-play writes them; remove the "
                                                "line or run it again");
    return std::move(parsed.json);
}

} // namespace

bool startsWithSchema(std::string_view text, std::string_view schema)
{
    text = text.substr(0, kSchemaWithin);
    const size_t key = text.find("\"schema\"");
    if (key == text.npos || text.find_first_not_of(std::string(kBlank) + "{") != key)
        return false;
    const size_t value = text.find_first_not_of(" \t\r\n:", key + std::string_view("\"schema\"").size());
    return value != text.npos && text.substr(value).starts_with('"') && text.substr(value + 1).starts_with(schema);
}

bool isTraceText(std::string_view text)
{
    return startsWithSchema(text, "gsc.service-trace/");
}

void addTraces(std::string_view text, const std::string& path, std::vector<ChartTrace>& traces)
{
    const std::string stem = std::filesystem::path(path).stem().string();
    const size_t first = traces.size();
    uint64_t number = 0;
    const auto add = [&](std::string_view one, const std::string& where) {
        ChartTrace trace;
        static_cast<ServiceTraceReport&>(trace) = parseServiceTrace(parsedTrace(one, where), where);
        traces.push_back(std::move(trace));
    };
    // indented by hand or by another program, it is no line but the whole file
    const std::string_view head = text.substr(0, text.find('\n'));
    if (const size_t end = head.find_last_not_of(kBlank); end != head.npos && head[end] != '}') {
        add(text, path);
        text = {};
    }
    while (!text.empty()) {
        throwIfInterrupted();
        ++number;
        const size_t end = text.find('\n');
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(end == text.npos ? text.size() : end + 1);
        if (line.find_first_not_of(kBlank) != line.npos)
            add(line, formatString("%s:%llu", path.c_str(), static_cast<unsigned long long>(number)));
    }
    for (size_t i = first; i < traces.size(); ++i)
        traces[i].title = traces.size() - first > 1 ? formatString("%s %zu", stem.c_str(), i - first + 1) : stem;
}

} // namespace gsc
