// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"

#include "format/error.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <utility>

namespace gsc {

namespace {

constexpr int kMaxDepth = 32;
constexpr size_t kMaxNodes = 20000; // aliases can unfold exponentially; upstream's files hold about 100

constexpr std::pair<const char*, const char*> kBooleans[] = {{"false", "true"}, {"False", "True"}, {"FALSE", "TRUE"},
                                                             {"no", "yes"},     {"No", "Yes"},     {"off", "on"},
                                                             {"Off", "On"}};

ConfigValue scalar(const std::string& text, bool quoted)
{
    ConfigValue value;
    value.kind = ConfigValue::Kind::String;
    value.text = text;
    if (quoted)
        return value;
    if (text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL")
        return {};
    for (const auto& [no, yes] : kBooleans)
        if (text == no || text == yes) {
            value.kind = ConfigValue::Kind::Bool;
            value.integer = text == yes;
        }
    std::string digits = text;
    digits.erase(std::remove(digits.begin(), digits.end(), '_'), digits.end());
    if (digits.find_first_of("0123456789") != std::string::npos)
        (void)readNumber(digits, value);
    return value;
}

ConfigValue convert(const YAML::Node& node, const std::string& file, int depth, size_t& nodes)
{
    if (depth > kMaxDepth || ++nodes > kMaxNodes)
        throw Error(ErrorCode::InvalidFile,
                    file + ": too many or too deeply nested values, expected the config.yaml that the trainer was "
                           "given; restore it or remove it");
    ConfigValue value;
    if (node.IsScalar())
        return scalar(node.Scalar(), node.Tag() == "!");
    if (node.IsSequence()) {
        value.kind = ConfigValue::Kind::List;
        for (const YAML::Node& item : node)
            value.list.push_back(convert(item, file, depth + 1, nodes));
    } else if (node.IsMap()) {
        value.kind = ConfigValue::Kind::Dict;
        for (const auto& entry : node)
            if (entry.first.IsScalar())
                value.add(entry.first.Scalar(), convert(entry.second, file, depth + 1, nodes));
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
        throw Error(ErrorCode::InvalidFile,
                    file + ": " + error.what() + ", expected the config.yaml that the trainer was given; restore it");
    }
}

} // namespace gsc
