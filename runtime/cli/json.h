// SPDX-License-Identifier: Apache-2.0
// JSON values as reports contain them.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace gsc {

using OrderedJson = nlohmann::ordered_json; // keys keep the order in which they were written

// Returns a number for JSON: null if the value is not finite, which JSON cannot state.
OrderedJson jsonNumber(double value);
// Writes JSON as text with `indent` spaces for each level; -1 = all in one line. Strings that are not UTF-8 are
// repaired.
std::string jsonText(const OrderedJson& json, int indent = 2);

} // namespace gsc
