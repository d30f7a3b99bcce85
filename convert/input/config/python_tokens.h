// SPDX-License-Identifier: Apache-2.0
// Words of a Python expression, with the values of those that are literals.
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
    size_t at = 0; // byte of the text
    std::string_view text;
    // Literal: a string or a number; Other where it is neither (bytes, f-strings, complex numbers, <...>).
    ConfigValue value;
};

// The last is an End. Line ends count as spaces; "<...>" where a value should be is what Python prints of an object.
// Throws Error(InvalidFile) where Python's own tokenizer would refuse, and for letters beyond ASCII in a name; `file` is
// used in messages only.
std::vector<PythonToken> pythonTokens(std::string_view text, const std::string& file);

// Error(InvalidFile) about byte `at` of the settings `file`.
[[noreturn]] void throwNoPython(const std::string& file, const std::string& found, size_t at);

} // namespace gsc
