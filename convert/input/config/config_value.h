// SPDX-License-Identifier: Apache-2.0
// The trainers' settings, read from cfg_args (text that Python printed) or config.yaml (Octree-AnyGS) into one tree of
// values.
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
    int64_t integer = 0; // value of a Bool or an Int
    double number = 0;   // value of an Int or a Float
    // String: its characters. Other: the source text. Dict: name of the class if it was printed as "Class(key=value)",
    // else empty.
    std::string text;
    std::vector<ConfigValue> list; // values of a List or a Dict, in the order of the file
    std::vector<std::string> keys; // key of each value of a Dict, in the order of `list`

    void add(std::string key, ConfigValue value); // adds a member to a Dict
    // Member of a Dict, and of the Dicts in it, by dotted path such as "model_config.kwargs.fork"; null if absent.
    [[nodiscard]] const ConfigValue* find(std::string_view path) const;
    [[nodiscard]] bool states(std::string_view path) const; // returns true if the member is there and not None
    [[nodiscard]] bool isTrue() const;                      // returns bool(value) of Python; false for an Other
    void setBool(bool value);
    // These return the member at `path`, or `fallback` if it is absent or None. They throw Error(Unsupported) if it has
    // another type or is an Other; a bool also counts as a number, and any value as a bool. `file` is used in messages
    // only.
    [[nodiscard]] bool getBool(std::string_view path, bool fallback, const std::string& file) const;
    [[nodiscard]] double getNumber(std::string_view path, double fallback, const std::string& file) const;
    [[nodiscard]] std::string getString(std::string_view path, const std::string& fallback,
                                        const std::string& file) const;

private:
    [[nodiscard]] const ConfigValue* typed(std::string_view path, std::initializer_list<Kind> kinds,
                                           const char* expected, const std::string& file) const;
};

// Sets `value` to the number that `text` spells; returns false, and changes nothing, if `text` is no number.
bool readNumber(const std::string& text, ConfigValue& value);

// Name for a message of the character at byte `at` of `text`: 'a', U+00A0, or byte 0xA0 where the text is not UTF-8.
std::string characterName(std::string_view text, size_t at);

// Reads "Namespace(key=value, ...)", the text that Python prints of an argparse.Namespace. Values may be strings with
// escapes, numbers, None, True, False, lists, tuples and dictionaries; any other value or expression is kept as its
// text. Throws Error: InvalidFile for text that Python cannot parse, Unsupported for an expression that is no
// Namespace.
ConfigValue parsePythonNamespace(std::string_view text, const std::string& file);

// Reads YAML, with numbers and words as PyYAML reads them (40_000 is a number). Throws Error(InvalidFile).
ConfigValue parseYaml(std::string_view text, const std::string& file);

} // namespace gsc
