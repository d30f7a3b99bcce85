// SPDX-License-Identifier: Apache-2.0
#include "player/play_options.h"

namespace gsc {

namespace {

// A decimal number and nothing else; false otherwise.
bool parseIndex(const std::string& text, uint64_t& value)
{
    if (text.empty() || text.size() > 15 || text.find_first_not_of("0123456789") != std::string::npos)
        return false;
    value = std::stoull(text);
    return true;
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
