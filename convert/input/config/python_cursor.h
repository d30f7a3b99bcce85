// SPDX-License-Identifier: Apache-2.0
// A position among the tokens of a Python expression, with the tests that a parser makes there.
#pragma once

#include "convert/input/config/python_tokens.h"
#include <gsc/error.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

class PythonCursor {
protected:
    // `text` and `file` must outlive this; `file` is used in messages only.
    PythonCursor(std::string_view text, const std::string& file) : m_file(file), m_tokens(pythonTokens(text, file)) {}

    [[noreturn]] void fail(const std::string& found) const { throwNoPython(m_file, found, peek().at); }

    [[noreturn]] void unsupported(const std::string& found) const
    {
        throw Error(ErrorCode::Unsupported, m_file, found, "'Namespace(...)' of literals as the trainers write it",
                    "write the values themselves there");
    }

    [[nodiscard]] const PythonToken& peek(size_t ahead = 0) const
    {
        return m_tokens[std::min(m_next + ahead, m_tokens.size() - 1)];
    }

    // Returns true if the next token, or the one `ahead` tokens behind it, is this operator or reserved word.
    [[nodiscard]] bool at(std::string_view word, size_t ahead = 0) const
    {
        const PythonToken& token = peek(ahead);
        return (token.kind == PythonKind::Operator || token.kind == PythonKind::Name) && token.text == word;
    }

    bool accept(std::string_view word)
    {
        const bool found = at(word);
        m_next += found;
        return found;
    }

    void require(std::string_view word)
    {
        if (!accept(word))
            fail("'" + std::string(word) + "' missing");
    }

    const std::string& m_file;
    std::vector<PythonToken> m_tokens; // ends with an End token
    size_t m_next = 0;
};

} // namespace gsc
