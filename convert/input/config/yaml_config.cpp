// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"

#include <gsc/error.h>

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace gsc {

namespace {

constexpr int kMaxDepth = 32;
// limit of nodes, because aliases can multiply them exponentially; files of Octree-AnyGS have about 100
constexpr size_t kMaxNodes = 20000;

using Kind = ConfigValue::Kind;

constexpr std::pair<const char*, const char*> kBooleans[] = {{"false", "true"}, {"False", "True"}, {"FALSE", "TRUE"},
                                                             {"no", "yes"},     {"No", "Yes"},     {"NO", "YES"},
                                                             {"off", "on"},     {"Off", "On"},     {"OFF", "ON"}};

// Reads a whole number of YAML 1.1 that is not decimal: 0x1f, 0b11, 017. Returns false if it is none.
bool readBased(std::string_view digits, ConfigValue& value)
{
    const bool negative = digits.starts_with('-');
    digits.remove_prefix(negative || digits.starts_with('+') ? 1 : 0);
    const int base = digits.starts_with("0x") ? 16 : digits.starts_with("0b") ? 2 : 8;
    if (digits.size() < 2 || digits[0] != '0')
        return false;
    digits.remove_prefix(base == 8 ? 1 : 2);
    int64_t number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number, base);
    if (error != std::errc() || end != digits.data() + digits.size() || number < 0)
        return false;
    value.kind = Kind::Int;
    value.integer = negative ? -number : number;
    value.number = double(value.integer);
    return true;
}

// Reads a number in base 60, as YAML 1.1 has it: 1:30 is 90. Returns false if it is none.
bool readSixties(const std::string& digits, ConfigValue& value)
{
    double sum = 0;
    for (size_t at = 0; at <= digits.size();) {
        const size_t end = std::min(digits.find(':', at), digits.size());
        const std::string part = digits.substr(at, end - at);
        if (part.empty() || part.size() > 9 || part.find_first_not_of("0123456789") != std::string::npos)
            return false;
        sum = sum * 60 + std::stod(part);
        at = end + 1;
    }
    value.kind = Kind::Int;
    value.integer = int64_t(sum);
    value.number = sum;
    return true;
}

bool readYamlNumber(std::string text, ConfigValue& value)
{
    if (const size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
        text.substr(sign) == ".inf" || text.substr(sign) == ".Inf" || text.substr(sign) == ".INF" || text == ".nan" ||
        text == ".NaN" || text == ".NAN")
        return readNumber(text.erase(sign, 1), value);
    text.erase(std::remove(text.begin(), text.end(), '_'), text.end());
    if (text.find_first_of("0123456789") == std::string::npos)
        return false;
    const size_t first = text.find_first_not_of("+-");
    const bool based = first < 2 && text[first] == '0' && text.find_first_of(".eE") == std::string::npos;
    if (based && text.size() > first + 1)
        return readBased(text, value);
    if (text.find('x') != std::string::npos || text.find('X') != std::string::npos)
        return readBased(text, value);
    return text.find(':') != std::string::npos ? readSixties(text, value) : readNumber(text, value);
}

// Value of a scalar. `tag`: its type as stated in the file, "!" for a quoted text.
ConfigValue scalar(const std::string& text, const std::string& tag)
{
    ConfigValue value;
    value.kind = Kind::String;
    value.text = text;
    if (tag == "!" || tag.ends_with(":str"))
        return value;
    if (text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL")
        return {};
    for (const auto& [no, yes] : kBooleans)
        if (text == no || text == yes)
            value.setBool(text == yes);
    if (value.kind == Kind::String)
        (void)readYamlNumber(text, value);
    return value;
}

// Adds the members of the value of the key "<<" to `into`. If the value is a list of dictionaries, the first one that
// has a key wins. The dictionary's own keys are added later, and of equal keys the last one counts.
void merge(ConfigValue more, ConfigValue& into)
{
    for (size_t i = more.list.size(); i-- > 0;) {
        if (more.kind == Kind::List)
            merge(std::move(more.list[i]), into);
        else if (more.kind == Kind::Dict)
            into.add(more.keys[i], std::move(more.list[i]));
    }
}

// Text of a key. The trainers' keys are ASCII; other characters are refused, because a no-break space copied from a web
// page would silently make another key.
std::string keyOf(const YAML::Node& node, const std::string& file)
{
    const std::string& key = node.Scalar();
    const auto strange = std::ranges::find_if(key, [](char c) { return (c & 0x80) != 0; });
    if (strange != key.end())
        throw Error(ErrorCode::InvalidFile, file,
                    "a key on line " + std::to_string(node.Mark().line + 1) + " has " +
                        characterName(key, size_t(strange - key.begin())),
                    "plain letters", "type that line anew");
    return key;
}

ConfigValue convert(const YAML::Node& node, const std::string& file, int depth, size_t& nodes)
{
    if (depth > kMaxDepth || ++nodes > kMaxNodes)
        throw Error(ErrorCode::InvalidFile, file, "too many or too deeply nested values",
                    "the config.yaml that the trainer was given", "restore it or remove it");
    ConfigValue value;
    if (node.IsScalar())
        return scalar(node.Scalar(), node.Tag());
    if (node.IsSequence()) {
        value.kind = Kind::List;
        for (const YAML::Node& item : node)
            value.list.push_back(convert(item, file, depth + 1, nodes));
    } else if (node.IsMap()) {
        value.kind = Kind::Dict;
        for (const auto& entry : node)
            if (entry.first.IsScalar() && entry.first.Scalar() == "<<")
                merge(convert(entry.second, file, depth + 1, nodes), value);
        for (const auto& entry : node)
            if (entry.first.IsScalar() && entry.first.Scalar() != "<<")
                value.add(keyOf(entry.first, file), convert(entry.second, file, depth + 1, nodes));
    }
    return value;
}

} // namespace

ConfigValue parseYaml(std::string_view text, const std::string& file)
{
    size_t nodes = 0;
    try {
        return convert(YAML::Load(std::string(text)), file, 0, nodes);
    } catch (const YAML::Exception& error) {
        throw Error(ErrorCode::InvalidFile, file, error.what(), "the config.yaml that the trainer was given",
                    "restore it");
    }
}

} // namespace gsc
