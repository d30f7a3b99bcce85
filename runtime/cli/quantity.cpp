// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/quantity.h"

#include <cctype>
#include <charconv>
#include <cmath>

namespace gsc {

namespace {

struct Parsed {
    uint64_t digits = 0;     // all digits as one integer, without the decimal point
    uint32_t fraction = 0;   // number of digits behind the decimal point
    std::string_view suffix; // unit behind the number, without leading spaces
};

std::optional<Parsed> parseDecimal(std::string_view text)
{
    Parsed parsed;
    bool any = false, point = false;
    size_t i = 0;
    for (; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '.' && !point) {
            point = true;
            continue;
        }
        if (!std::isdigit(static_cast<unsigned char>(c)))
            break;
        if (parsed.digits > (UINT64_MAX - 9) / 10)
            return std::nullopt;
        parsed.digits = 10 * parsed.digits + uint64_t(c - '0');
        parsed.fraction += point;
        any = true;
    }
    while (i < text.size() && text[i] == ' ')
        ++i;
    parsed.suffix = text.substr(i);
    return any ? std::optional(parsed) : std::nullopt;
}

// Returns the power of the unit (K = 1, M = 2, ...); -1 if the letter is no unit.
int unitPower(char unit)
{
    const size_t at = std::string_view("kmgt").find(char(std::tolower(static_cast<unsigned char>(unit))));
    return at == std::string_view::npos ? -1 : int(at) + 1;
}

// Computes digits / 10^fraction * base^power, rounded down. `whole` receives whether the result is exact.
std::optional<uint64_t> scale(const Parsed& parsed, uint64_t base, int power, bool& whole)
{
    long double value = static_cast<long double>(parsed.digits);
    for (int i = 0; i < power; ++i)
        value *= static_cast<long double>(base);
    for (uint32_t i = 0; i < parsed.fraction; ++i)
        value /= 10.0L;
    if (!(value < 18446744073709551616.0L))
        return std::nullopt;
    whole = std::floor(value) == value;
    return uint64_t(value);
}

} // namespace

std::optional<uint64_t> parseByteSize(std::string_view text)
{
    auto parsed = parseDecimal(text);
    if (!parsed)
        return std::nullopt;
    std::string_view suffix = parsed->suffix;
    int power = 0;
    if (!suffix.empty() && unitPower(suffix[0]) > 0) {
        power = unitPower(suffix[0]);
        suffix.remove_prefix(1);
        if (!suffix.empty() && suffix[0] == 'i')
            suffix.remove_prefix(1);
    }
    if (suffix == "B" || suffix == "b")
        suffix = {};
    if (!suffix.empty())
        return std::nullopt;
    bool whole = false;
    return scale(*parsed, 1024, power, whole);
}

std::optional<uint64_t> parseCount(std::string_view text)
{
    auto parsed = parseDecimal(text);
    if (!parsed || parsed->suffix.size() > 1)
        return std::nullopt;
    const int power = parsed->suffix.empty() ? 0 : unitPower(parsed->suffix[0]);
    if (power < 0)
        return std::nullopt;
    bool whole = false;
    const auto count = scale(*parsed, 1000, power, whole);
    return whole ? count : std::nullopt;
}

std::optional<ImageSize> parseImageSize(std::string_view text)
{
    const auto takeSide = [](std::string_view digits, uint32_t& side) {
        const char* const end = digits.data() + digits.size();
        const auto [stop, error] = std::from_chars(digits.data(), end, side);
        return error == std::errc() && stop == end && side >= 1 && side <= 32768;
    };
    const size_t x = text.find_first_of("xX");
    ImageSize size;
    if (text.ends_with('p')) {
        if (!takeSide(text.substr(0, text.size() - 1), size.height) || size.height > 18432)
            return std::nullopt;
        size.width = (size.height * 16 + 8) / 9 / 2 * 2; // even, as videos need
        return size;
    }
    if (!takeSide(text.substr(0, x), size.width))
        return std::nullopt;
    if (x != std::string_view::npos && !takeSide(text.substr(x + 1), size.height))
        return std::nullopt;
    return size;
}

} // namespace gsc
