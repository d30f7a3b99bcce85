// SPDX-License-Identifier: Apache-2.0
// Splits a Python expression into tokens, with the values of those that are literals.
#pragma once

#include "convert/input/config/config_value.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class PythonKind : uint8_t { Name, Literal, Operator, End };

struct PythonToken {
    PythonKind kind = PythonKind::End;
    size_t at = 0; // byte offset in the text
    std::string_view text;
    // Value of a Literal: a string or a number, or kind Other for bytes, f-strings, complex numbers and <...>.
    ConfigValue value;
};

// Splits `text` into tokens, the last of which is an End. Line ends count as spaces. "<...>" in the place of a value is
// a Literal: Python prints objects so. Throws Error(InvalidFile) where Python's own tokenizer would, and for letters
// beyond ASCII in a name; `file` is used in messages only.
std::vector<PythonToken> pythonTokens(std::string_view text, const std::string& file);

// Throws Error(InvalidFile) that says that byte `at` of the settings file `file` is not Python.
[[noreturn]] void throwNoPython(const std::string& file, const std::string& found, size_t at);

} // namespace gsc
