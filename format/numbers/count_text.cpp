// SPDX-License-Identifier: Apache-2.0
#include "format/numbers/count_text.h"

namespace gsc {

std::string formatCount(uint64_t count)
{
    std::string text = std::to_string(count);
    for (size_t i = text.size(); i > 3; i -= 3)
        text.insert(i - 3, 1, ',');
    return text;
}

std::string formatCount(uint64_t count, const char* noun, const char* plural)
{
    return formatCount(count) + " " +
           (count == 1          ? noun
            : plural != nullptr ? std::string(plural)
                                : std::string(noun) + "s");
}

} // namespace gsc
