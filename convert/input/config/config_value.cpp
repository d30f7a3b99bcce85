// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"

#include <gsc/error.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace gsc {

void ConfigValue::add(std::string key, ConfigValue value)
{
    keys.push_back(std::move(key));
    list.push_back(std::move(value));
}

const ConfigValue* ConfigValue::find(std::string_view path) const
{
    const ConfigValue* node = this;
    while (node && !path.empty()) {
        const size_t dot = path.find('.');
        const std::string_view key = path.substr(0, dot);
        path = dot == std::string_view::npos ? std::string_view() : path.substr(dot + 1);
        const ConfigValue* next = nullptr;
        for (size_t i = 0; i < node->keys.size(); ++i)
            if (node->keys[i] == key)
                // of equal keys the last one counts, as in Python
                next = &node->list[i];
        node = next;
    }
    return node;
}

bool ConfigValue::states(std::string_view path) const
{
    const ConfigValue* value = find(path);
    return value && value->kind != Kind::None;
}

const ConfigValue* ConfigValue::typed(std::string_view path, std::initializer_list<Kind> kinds, const char* expected,
                                      const std::string& file) const
{
    if (!states(path))
        return nullptr;
    const ConfigValue* value = find(path);
    if (std::ranges::find(kinds, value->kind) == kinds.end())
        throw Error(ErrorCode::Unsupported, file,
                    "'" + std::string(path) + "' " +
                        (value->kind == Kind::Other ? "is the expression '" + value->text.substr(0, 64) + "'"
                                                    : "has another type"),
                    expected, "write the value itself there");
    return value;
}

bool ConfigValue::isTrue() const
{
    switch (kind) {
    case Kind::None:
        return false;
    case Kind::Bool:
    case Kind::Int:
    case Kind::Float:
        return number != 0 || integer != 0;
    case Kind::String:
        return !text.empty();
    default:
        return !list.empty();
    }
}

void ConfigValue::setBool(bool value)
{
    kind = Kind::Bool;
    integer = value;
    number = value;
}

bool ConfigValue::getBool(std::string_view path, bool fallback, const std::string& file) const
{
    const ConfigValue* value =
        typed(path, {Kind::Bool, Kind::Int, Kind::Float, Kind::String, Kind::List, Kind::Dict}, "True or False", file);
    return value ? value->isTrue() : fallback;
}

double ConfigValue::getNumber(std::string_view path, double fallback, const std::string& file) const
{
    const ConfigValue* value = typed(path, {Kind::Bool, Kind::Int, Kind::Float}, "a number", file);
    return value ? value->number : fallback;
}

std::string ConfigValue::getString(std::string_view path, const std::string& fallback, const std::string& file) const
{
    const ConfigValue* value = typed(path, {Kind::String}, "a string", file);
    return value ? value->text : fallback;
}

std::string characterName(std::string_view text, size_t at)
{
    const auto first = uint8_t(text[at]);
    if (first > 0x20 && first < 0x7f)
        return std::string("'") + text[at] + "'";
    // tables by length in bytes of a UTF-8 character: `least` is the smallest code that needs so many, `bits` the bits
    // of its first byte that belong to the code
    const size_t bytes = first < 0x80   ? 1
                         : first < 0xc2 ? 0
                         : first < 0xe0 ? 2
                         : first < 0xf0 ? 3
                         : first < 0xf5 ? 4
                                        : 0;
    constexpr uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000}, bits[] = {0, 0x7f, 0x1f, 0x0f, 0x07};
    uint32_t code = first & bits[bytes];
    bool is_utf8 = bytes != 0 && at + bytes <= text.size();
    for (size_t i = 1; is_utf8 && i < bytes; ++i) {
        const auto next = uint8_t(text[at + i]);
        is_utf8 = (next & 0xc0) == 0x80;
        code = code << 6 | (next & 0x3fu);
    }
    return is_utf8 && code >= least[bytes] ? formatString("U+%04X", code) : formatString("byte 0x%02X", first);
}

bool readNumber(const std::string& text, ConfigValue& value)
{
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0')
        return false;
    value.number = number;
    const bool whole = text.find_first_not_of("+-0123456789") == std::string::npos;
    value.kind = whole ? ConfigValue::Kind::Int : ConfigValue::Kind::Float;
    if (whole)
        value.integer = std::strtoll(text.c_str(), nullptr, 10);
    return true;
}

} // namespace gsc
