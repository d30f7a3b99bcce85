// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/row_lines.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>

namespace gsc {

namespace {

// Kinds of rows that earlier versions wrote, and the command that makes rows of this version.
constexpr struct {
    const char* kind;
    const char* command;
} kMakers[] = {
    {"gsc.run/", "gsc-play bench MODEL.gsc --sweep SWEEP.json --out RUNS.jsonl"},
    {"gsc.bench/", "gsc-play bench MODEL.gsc --out RUNS.jsonl"},
    {"gsc.stability/", "gsc-play stability MODEL.gsc --trajectories PATHS --format json > RUNS.jsonl"},
    {"gsc.curve/", "gsc bake MODEL.gsc --curve 60,50,40 -o CURVE.jsonl"},
};

} // namespace

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

std::string_view firstSchema(std::string_view text)
{
    text = text.substr(0, 1000);
    const size_t key = text.find("\"schema\"");
    if (key == text.npos || text.find_first_not_of(" \t\r\n{") != key)
        return {};
    const size_t value = text.find_first_not_of(" \t\r\n:", key + std::string_view("\"schema\"").size());
    if (value == text.npos || text[value] != '"')
        return {};
    text.remove_prefix(value + 1);
    return text.substr(0, text.find('"'));
}

void refuseOtherVersion(std::string_view line, const std::string& where)
{
    (void)isRunSchema(std::string(firstSchema(line)), where);
}

bool isRunSchema(const std::string& schema, const std::string& where)
{
    if (schema == kRunSchema)
        return true;
    for (const auto& [kind, command] : kMakers) {
        if (!schema.starts_with(kind))
            continue;
        const bool is_old = schema == std::string(kind) + "1";
        throw Error(ErrorCode::Unsupported, where, "schema is " + schema + (is_old ? ", of an earlier version" : ""),
                    kRunSchema,
                    is_old ? "make new rows with " + std::string(command)
                           : "use the version of the program that wrote it");
    }
    return false;
}

RunRow runRowOf(const OrderedJson& json, const std::string& where)
{
    RunRow row;
    describe(Record(json, where), row);
    return row;
}

} // namespace gsc
