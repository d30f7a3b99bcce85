// SPDX-License-Identifier: Apache-2.0
#include "format/utf8.h"

#include <cstdint>

namespace gsc {

size_t utf8Prefix(std::string_view text)
{
    for (size_t i = 0; i < text.size();) {
        const uint8_t c = uint8_t(text[i]);
        const size_t length = c < 0x80                ? 1
                              : c >= 0xc2 && c < 0xe0 ? 2
                              : c >= 0xe0 && c < 0xf0 ? 3
                              : c >= 0xf0 && c < 0xf5 ? 4
                                                      : 0;
        if (length == 0 || length > text.size() - i)
            return i;
        for (size_t k = 1; k < length; ++k)
            if ((uint8_t(text[i + k]) & 0xc0) != 0x80)
                return i;
        const uint8_t second = length > 1 ? uint8_t(text[i + 1]) : 0;
        // overlong forms, surrogates, beyond U+10FFFF
        if ((c == 0xe0 && second < 0xa0) || (c == 0xed && second >= 0xa0) || (c == 0xf0 && second < 0x90) ||
            (c == 0xf4 && second >= 0x90))
            return i;
        i += length;
    }
    return text.size();
}

std::string validUtf8(std::string_view text)
{
    std::string valid;
    valid.reserve(text.size());
    while (!text.empty()) {
        const size_t good = utf8Prefix(text);
        for (const char c : text.substr(0, good)) {
            const bool is_control = (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f;
            valid += is_control ? '?' : c;
        }
        text.remove_prefix(good);
        if (text.empty())
            break;
        valid += "\xef\xbf\xbd";
        text.remove_prefix(1);
    }
    return valid;
}

} // namespace gsc
