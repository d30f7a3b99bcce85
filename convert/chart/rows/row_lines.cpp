// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/rows/row_lines.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "runtime/records/record.h"

namespace gsc {

void forEachRow(std::string_view text, const std::string& path,
                const std::function<void(std::string_view line, const std::string& where)>& take)
{
    for (size_t number = 1; !text.empty(); ++number) {
        throwIfInterrupted();
        const std::string_view line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        if (line.find_first_not_of(" \t\r") != line.npos)
            take(line, formatString("%s:%zu", path.c_str(), number));
    }
}

OrderedJson rowOf(std::string_view line, const std::string& where, const char* expected)
{
    ParsedRow parsed = parseRow(line);
    if (parsed.state != ParsedRow::State::Whole)
        throw Error(ErrorCode::InvalidFile, where, parsed.fault, expected, "remove the line or run it again");
    return std::move(parsed.json);
}

bool startsWithSchema(std::string_view text, std::string_view schema)
{
    text = text.substr(0, 1000);
    const size_t key = text.find("\"schema\"");
    if (key == text.npos || text.find_first_not_of(" \t\r\n{") != key)
        return false;
    const size_t value = text.find_first_not_of(" \t\r\n:", key + std::string_view("\"schema\"").size());
    return value != text.npos && text.substr(value).starts_with('"') && text.substr(value + 1).starts_with(schema);
}

} // namespace gsc
