// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"

#include "format/error.h"

#include <utility>

namespace gsc {

namespace {

[[noreturn]] void throwType(std::string_view path, const char* expected, const std::string& file)
{
    throw Error(ErrorCode::InvalidFile, file + ": '" + std::string(path) + "' has another type, expected " + expected +
                                            "; restore the file that the trainer wrote");
}

const ConfigValue* present(const ConfigValue& root, std::string_view path)
{
    const ConfigValue* value = root.find(path);
    return value && value->kind != ConfigValue::Kind::None ? value : nullptr;
}

} // namespace

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
                next = &node->list[i]; // the last of several wins, as in Python
        node = next;
    }
    return node;
}

bool ConfigValue::states(std::string_view path) const
{
    return present(*this, path) != nullptr;
}

bool ConfigValue::getBool(std::string_view path, bool fallback, const std::string& file) const
{
    const ConfigValue* value = present(*this, path);
    if (value && value->kind != Kind::Bool && value->kind != Kind::Int)
        throwType(path, "True or False", file);
    return value ? value->integer != 0 : fallback;
}

double ConfigValue::getNumber(std::string_view path, double fallback, const std::string& file) const
{
    const ConfigValue* value = present(*this, path);
    if (value && value->kind != Kind::Int && value->kind != Kind::Float)
        throwType(path, "a number", file);
    return value ? value->number : fallback;
}

std::string ConfigValue::getString(std::string_view path, const std::string& fallback, const std::string& file) const
{
    const ConfigValue* value = present(*this, path);
    if (value && value->kind != Kind::String)
        throwType(path, "a string", file);
    return value ? value->text : fallback;
}

} // namespace gsc
