// SPDX-License-Identifier: Apache-2.0
// Reader of files of measurements: lines of JSON, one row each.
#pragma once

#include "runtime/records/run_row.h"

#include <functional>
#include <string>
#include <string_view>

namespace gsc {

// Hands every line of `text` that is not blank to `take`, without its end; `where` names it in messages, such as
// "runs.jsonl:12". Throws Error(Interrupted), and the errors of `take`.
void forEachRow(std::string_view text, const std::string& path,
                const std::function<void(std::string_view line, const std::string& where)>& take);

// JSON of a line. `expected` is the right content in words, such as "one object per line as gsc-play bench writes them".
// Throws Error(InvalidFile).
OrderedJson rowOf(std::string_view line, const std::string& where, const char* expected);

// The schema that the first line states; empty unless "schema" is the first key of an object.
std::string_view firstSchema(std::string_view text);

// True if `schema` is kRunSchema. Throws Error(Unsupported) for another version of it: names the command that makes new rows
// if it is older, the program to use if it is newer.
bool isRunSchema(const std::string& schema, const std::string& where);

// Throws as isRunSchema() if a line begins like a measurement of another version.
void refuseOtherVersion(std::string_view line, const std::string& where);

// The measurement of a line that has kRunSchema. Throws Error(InvalidFile).
RunRow runRowOf(const OrderedJson& json, const std::string& where);

} // namespace gsc
