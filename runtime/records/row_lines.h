// SPDX-License-Identifier: Apache-2.0
// Lines of JSON, one row each: the one reader of measurements that files hold.
#pragma once

#include "runtime/records/run_row.h"

#include <functional>
#include <string>
#include <string_view>

namespace gsc {

// Hands every line of `text` that is not blank to `take`, without its end; `where` names it in messages, such as
// "runs.jsonl:12". Throws Error(Interrupted), and as `take`.
void forEachRow(std::string_view text, const std::string& path,
                const std::function<void(std::string_view line, const std::string& where)>& take);

// The JSON of a line. `expected` is for the message, such as "one object per line as gsc-play bench writes them". Throws
// Error(InvalidFile).
OrderedJson rowOf(std::string_view line, const std::string& where, const char* expected);

// The schema of the first line, where it is the first key of an object; else empty.
std::string_view firstSchema(std::string_view text);

// Is `schema` that of a measurement? Throws Error(Unsupported) for one of another version: with the command that makes
// new rows, or for a newer one with the program to use.
bool isRunSchema(const std::string& schema, const std::string& where);

// Throws as isRunSchema() where a line begins as such a measurement.
void refuseOtherVersion(std::string_view line, const std::string& where);

// The measurement of a line that has kRunSchema. Throws Error(InvalidFile).
RunRow runRowOf(const OrderedJson& json, const std::string& where);

} // namespace gsc
