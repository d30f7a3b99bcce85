// SPDX-License-Identifier: Apache-2.0
// The trainers' own settings: cfg_args (a Python repr) and config.yaml (Octree-AnyGS), as one tree of values.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct ConfigValue {
    enum class Kind : uint8_t { None, Bool, Int, Float, String, List, Dict, Other };

    Kind kind = Kind::None;
    int64_t integer = 0;           // Bool, Int
    double number = 0;             // Int, Float
    std::string text;              // String; Other: the source text; Dict: the class whose call it was, if any
    std::vector<ConfigValue> list; // List, Dict: values in the order of the file
    std::vector<std::string> keys; // Dict: of each value

    void add(std::string key, ConfigValue value); // adds to a dictionary
    // Member of a dictionary by dotted path, such as "model_config.kwargs.fork"; null if absent.
    [[nodiscard]] const ConfigValue* find(std::string_view path) const;
    [[nodiscard]] bool states(std::string_view path) const; // present and not None
    [[nodiscard]] bool isTrue() const;                      // Python's bool(); not known for an Other
    void setBool(bool value);
    // The member, or `fallback` where it is absent or None. Throws Error(Unsupported) if it has another type or is an
    // Other; a bool is a number, and any value is true or false. `file` is used in messages only.
    [[nodiscard]] bool getBool(std::string_view path, bool fallback, const std::string& file) const;
    [[nodiscard]] double getNumber(std::string_view path, double fallback, const std::string& file) const;
    [[nodiscard]] std::string getString(std::string_view path, const std::string& fallback,
                                        const std::string& file) const;

private:
    [[nodiscard]] const ConfigValue* typed(std::string_view path, std::initializer_list<Kind> kinds,
                                           const char* expected, const std::string& file) const;
};

// Sets `value` to the number that `text` is; false, and nothing is set, if it is none.
bool readNumber(const std::string& text, ConfigValue& value);

// The character at byte `at` of `text` for a message: 'a', U+00A0, or byte 0xA0 where it is no UTF-8.
std::string characterName(std::string_view text, size_t at);

// "Namespace(key=value, ...)" as Python prints an argparse.Namespace: strings with escapes, numbers, None, True,
// False, lists, tuples, dictionaries; values of any other type, and expressions, are kept as text. Throws Error:
// InvalidFile for what Python does not parse, Unsupported for an expression that is no Namespace.
ConfigValue parsePythonNamespace(std::string_view text, const std::string& file);

// YAML with PyYAML's reading of scalars (40_000 is a number). Throws Error(InvalidFile).
ConfigValue parseYaml(std::string_view text, const std::string& file);

} // namespace gsc
