// SPDX-License-Identifier: Apache-2.0
#include "player/options/camera_choice.h"

#include <charconv>

namespace gsc {

namespace {

// Parses a decimal number; returns false if the text holds anything else.
bool parseIndex(const std::string& text, uint64_t& value)
{
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end;
}

} // namespace

bool parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end)
{
    const size_t colon = text.find(':');
    if (colon == std::string::npos)
        return false;
    const std::string head = text.substr(0, colon), tail = text.substr(colon + 1);
    uint64_t a = 0, b = std::numeric_limits<uint64_t>::max();
    if ((!head.empty() && !parseIndex(head, a)) || (!tail.empty() && !parseIndex(tail, b)) || a >= b)
        return false;
    first = a;
    end = b;
    return true;
}

} // namespace gsc
