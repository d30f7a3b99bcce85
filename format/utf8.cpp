// SPDX-License-Identifier: Apache-2.0
#include <gsc/utf8.h>

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
        // refuses overlong forms, surrogates, and characters beyond U+10FFFF
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

namespace {

void append(std::string& out, uint32_t code)
{
    // bytes behind the first byte of the character
    const int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    out += more == 0 ? char(code) : char(0xf0 << (3 - more) | (code >> 6 * more & 0x3f >> more));
    for (int i = more; i-- > 0;)
        out += char(0x80 | (code >> 6 * i & 0x3f));
}

// Returns true if `bytes` are text in UTF-16 with a byte order mark. note: binary files that start with a count have
// zeros where text has its second character
bool isUtf16(std::string_view bytes, bool big_endian)
{
    const auto unit = [&](size_t i) {
        const auto first = uint8_t(bytes[2 * i]), second = uint8_t(bytes[2 * i + 1]);
        return big_endian ? first << 8 | second : second << 8 | first;
    };
    const size_t units = bytes.size() / 2;
    return bytes.size() % 2 == 0 && units > 1 && unit(0) == 0xfeff && unit(1) >= '\t' && unit(1) < 0x80 &&
           (units == 2 || unit(2) != 0);
}

std::string fromUtf16(std::string_view bytes, bool big_endian)
{
    std::string text;
    uint32_t high = 0; // first half of a surrogate pair, while the second half is awaited; else 0
    for (size_t i = 2; i + 1 < bytes.size(); i += 2) {
        const auto first = uint8_t(bytes[i]), second = uint8_t(bytes[i + 1]);
        const uint32_t unit = uint32_t(big_endian ? first << 8 | second : second << 8 | first);
        const bool is_high = unit >= 0xd800 && unit < 0xdc00, is_low = unit >= 0xdc00 && unit < 0xe000;
        if (high != 0 && is_low) {
            append(text, 0x10000 + ((high - 0xd800) << 10) + (unit - 0xdc00));
            high = 0;
            continue;
        }
        if (high != 0 || is_low)
            append(text, 0xfffd);
        high = is_high ? unit : 0;
        if (!is_high && !is_low)
            append(text, unit);
    }
    return text;
}

} // namespace

std::string decodedText(std::string bytes)
{
    if (bytes.starts_with("\xef\xbb\xbf"))
        return bytes.substr(3);
    for (const bool big_endian : {false, true})
        if (isUtf16(bytes, big_endian))
            return fromUtf16(bytes, big_endian);
    return bytes;
}

} // namespace gsc
