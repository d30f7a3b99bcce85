// SPDX-License-Identifier: Apache-2.0
// Lines of JSON, one row each.
#pragma once

#include "runtime/cli/json.h"

#include <functional>
#include <string>
#include <string_view>

namespace gsc {

// Hands every line of `text` that is not blank to `take`; `where` names it in messages, such as "runs.jsonl:12". Throws
// Error(Interrupted), and as `take`.
void forEachRow(std::string_view text, const std::string& path,
                const std::function<void(std::string_view line, const std::string& where)>& take);

// The JSON of a line. `expected` is for the message, such as "one object per line as gsc bake --curve writes them". Throws
// Error(InvalidFile).
OrderedJson rowOf(std::string_view line, const std::string& where, const char* expected);

// Does it begin with an object whose first key is "schema", its value beginning with `schema`?
bool startsWithSchema(std::string_view text, std::string_view schema);

} // namespace gsc
