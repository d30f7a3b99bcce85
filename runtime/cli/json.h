// SPDX-License-Identifier: Apache-2.0
// JSON as reports hold it.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace gsc {

using OrderedJson = nlohmann::ordered_json; // keys come out in the order they were written

// A number JSON can hold: null where the value is not finite.
OrderedJson jsonNumber(double value);
// Text of a report, `indent` spaces a level, -1 = one line; strings that are not UTF-8 are repaired, never thrown on.
std::string jsonText(const OrderedJson& json, int indent = 2);

} // namespace gsc
