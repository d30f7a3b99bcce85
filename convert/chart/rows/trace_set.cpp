// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/rows/trace_set.h"

#include "runtime/records/row_lines.h"
#include <gsc/error.h>

#include <filesystem>

namespace gsc {

bool isTraceText(std::string_view text)
{
    return firstSchema(text).starts_with("gsc.service-trace/");
}

void addTraces(std::string_view text, const std::string& path, std::vector<ChartTrace>& traces)
{
    const std::string stem = std::filesystem::path(path).stem().string();
    const size_t first = traces.size();
    const auto add = [&](std::string_view one, const std::string& where) {
        ChartTrace trace;
        static_cast<ServiceTraceReport&>(trace) =
            parseServiceTrace(rowOf(one, where, "one trace per line as gsc-play writes them"), where);
        traces.push_back(std::move(trace));
    };
    // a trace that was indented is no line: the whole file is one trace
    const std::string_view head = text.substr(0, text.find('\n'));
    if (const size_t end = head.find_last_not_of(" \t\r"); end != head.npos && head[end] != '}') {
        add(text, path);
        text = {};
    }
    forEachRow(text, path, add);
    for (size_t i = first; i < traces.size(); ++i)
        traces[i].title = traces.size() - first > 1 ? formatString("%s %zu", stem.c_str(), i - first + 1) : stem;
}

} // namespace gsc
