// SPDX-License-Identifier: Apache-2.0
// Python's repr of a Namespace. A parser and not a split at commas: paths may hold any character (trap 35). The trainers
// give the file to eval(), so every expression is parsed; literals have values, all else is kept as text.
#include "convert/input/config/config_value.h"
#include "convert/input/config/python_cursor.h"
#include <gsc/error.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace gsc {

namespace {

using Kind = ConfigValue::Kind;

constexpr int kMaxDepth = 32;

constexpr std::string_view kBinary[] = {"+", "-", "*",  "/",  "//", "%",  "**", "@",  "&",   "|",  "^",
                                        "<", ">", "<=", ">=", "==", "!=", "<<", ">>", "and", "or", "in"};
// Words that are no names.
constexpr std::string_view kReserved[] = {
    "and",      "as",     "assert",  "async", "await", "break",  "class", "continue", "def",  "del",  "elif",
    "else",     "except", "finally", "for",   "from",  "global", "if",    "import",   "in",   "is",   "lambda",
    "nonlocal", "not",    "or",      "pass",  "raise", "return", "try",   "while",    "with", "yield"};

// Words that are values, and no names that could be given one.
constexpr std::string_view kConstants[] = {"None", "True", "False"};

template <size_t N>
bool isOneOf(std::string_view word, const std::string_view (&words)[N])
{
    return std::ranges::find(words, word) != std::end(words);
}

bool isNamespace(std::string_view callee)
{
    return callee == "Namespace" || callee.ends_with(".Namespace");
}

class ReprParser : PythonCursor {
public:
    ReprParser(std::string_view text, const std::string& file) : PythonCursor(text, file), m_text(text) {}

    ConfigValue run()
    {
        if (m_tokens.size() <= 2 && m_tokens[0].kind != PythonKind::Literal) // no token, or an undefined word
            fail("does not start with 'Namespace('");
        ConfigValue value = expression(0);
        const bool is_tuple = at(",");
        if (!is_tuple && peek().kind != PythonKind::End)
            fail("text after the expression");
        if (is_tuple || value.kind != Kind::Dict || !isNamespace(value.text))
            unsupported("is a Python expression but no Namespace of named values");
        return value;
    }

private:
    // Keeps an expression that is no constant as text, from token `first` on.
    [[nodiscard]] ConfigValue other(size_t first) const
    {
        ConfigValue result;
        result.kind = Kind::Other;
        const PythonToken& last = m_tokens[m_next - 1];
        result.text = m_text.substr(m_tokens[first].at, last.at + last.text.size() - m_tokens[first].at);
        return result;
    }

    // `conditional`: "a if b else c" is one too; not so within a comprehension, where "if" starts a clause.
    ConfigValue expression(int depth, bool conditional = true)
    {
        if (depth > kMaxDepth)
            unsupported(formatString("has values nested deeper than %d", kMaxDepth));
        const size_t first = m_next;
        if (accept("lambda")) {
            parameters(depth);
            (void)expression(depth + 1, conditional);
            return other(first);
        }
        ConfigValue value = operand(depth);
        bool is_literal = true;
        while (binary()) {
            (void)operand(depth);
            is_literal = false;
        }
        if (accept(":=")) {
            (void)expression(depth + 1, conditional);
            is_literal = false;
        }
        if (conditional && accept("if")) {
            (void)expression(depth + 1, false);
            require("else");
            (void)expression(depth + 1);
            is_literal = false;
        }
        return is_literal ? value : other(first);
    }

    bool binary()
    {
        if (at("is") || (at("not") && at("in", 1))) {
            m_next += at("not", 1) || at("not") ? 2 : 1;
            return true;
        }
        const bool found = peek().kind != PythonKind::Literal && isOneOf(peek().text, kBinary);
        m_next += found;
        return found;
    }

    // Parameters of a lambda, up to its colon.
    void parameters(int depth)
    {
        while (!accept(":")) {
            if (accept("*") || accept("**") || accept("/") || accept(","))
                continue;
            name();
            if (accept("="))
                (void)expression(depth + 1);
        }
    }

    std::string nameOrConstant()
    {
        if (peek().kind != PythonKind::Name || isOneOf(peek().text, kReserved))
            fail("name missing");
        return std::string(m_tokens[m_next++].text);
    }

    std::string name()
    {
        if (isOneOf(peek().text, kConstants))
            fail("'" + std::string(peek().text) + "' is no name");
        return nameOrConstant();
    }

    ConfigValue operand(int depth)
    {
        const size_t first = m_next;
        while (at("+") || at("-") || at("~") || at("not") || at("await"))
            ++m_next;
        const size_t signs = m_next - first;
        ConfigValue value = primary(depth);
        for (size_t i = signs; i-- > 0;)
            if (!apply(m_tokens[first + i].text, value))
                return other(first);
        return value;
    }

    static bool apply(std::string_view sign, ConfigValue& value)
    {
        const bool whole = value.kind == Kind::Int || value.kind == Kind::Bool;
        if (sign == "not" && value.kind != Kind::Other) {
            const bool truth = value.isTrue();
            value = {};
            value.setBool(!truth);
            return true;
        }
        if (sign == "await" || sign == "not" || (!whole && value.kind != Kind::Float) || (sign == "~" && !whole))
            return false;
        value.kind = whole ? Kind::Int : Kind::Float;
        if (sign != "+") {
            value.number = -value.number - (sign == "~" ? 1 : 0);
            value.integer = sign == "~" ? ~value.integer : -value.integer;
        }
        return true;
    }

    ConfigValue primary(int depth)
    {
        const size_t first = m_next;
        ConfigValue value = atom(depth);
        bool is_path = m_next == first + 1 && m_tokens[first].kind == PythonKind::Name; // names with dots
        for (;;) {
            if (accept(".")) {
                (void)name();
            } else if (at("(")) {
                const std::string callee = is_path ? other(first).text : std::string();
                bool known = true;
                ConfigValue result = arguments(depth, isNamespace(callee), known);
                const bool is_dict = is_path && known && (!result.keys.empty() || callee.ends_with("Namespace"));
                if (is_dict && !at(".") && !at("(") && !at("[")) {
                    result.text = callee;
                    return result;
                }
                is_path = false;
            } else if (at("[")) {
                subscripts(depth);
                is_path = false;
            } else {
                return m_next == m_after_atom ? value : other(first);
            }
        }
    }

    ConfigValue atom(int depth)
    {
        const size_t first = m_next;
        ConfigValue value;
        if (peek().kind == PythonKind::Literal)
            value = literals();
        else if (at("("))
            value = bracketed(depth, ")", Kind::List);
        else if (at("["))
            value = bracketed(depth, "]", Kind::List);
        else if (at("{"))
            value = braces(depth);
        else if (accept("..."))
            value = other(first);
        else
            value = word();
        m_after_atom = m_next;
        return value;
    }

    // Strings side by side are one.
    ConfigValue literals()
    {
        const size_t first = m_next;
        ConfigValue value = m_tokens[m_next++].value;
        while (peek().kind == PythonKind::Literal) {
            const auto isText = [](const PythonToken& token) {
                return token.text.find_first_of("'\"") != token.text.npos;
            };
            if (!isText(m_tokens[first]) || !isText(peek()))
                fail("',' missing");
            value.text += peek().value.text;
            value.kind = peek().value.kind == Kind::String ? value.kind : Kind::Other;
            ++m_next;
        }
        return value.kind == Kind::Other ? other(first) : value;
    }

    ConfigValue word()
    {
        const size_t first = m_next;
        const std::string text = nameOrConstant();
        ConfigValue result;
        if (text == "None")
            return result;
        if (text == "True" || text == "False")
            result.setBool(text == "True");
        else if ((text != "inf" && text != "nan") || !readNumber(text, result))
            return other(first);
        return result;
    }

    // Clauses behind the first item of a comprehension; false where there are none.
    bool comprehension(int depth)
    {
        const bool found = at("for") || at("async");
        while (at("for") || at("async") || at("if")) {
            (void)accept("async");
            m_next += 1;
            do
                (void)expression(depth + 1, false); // "x in y" is read as a comparison, which has the same words
            while (accept(","));
        }
        return found;
    }

    // ( or [ up to `close`. Brackets around one value are that value.
    ConfigValue bracketed(int depth, std::string_view close, Kind kind)
    {
        const size_t first = m_next++;
        ConfigValue result;
        result.kind = kind;
        bool known = !accept("yield"), comma = close == "]";
        (void)(known || accept("from"));
        while (!accept(close)) {
            known = !accept("*") && known;
            result.list.push_back(expression(depth + 1));
            known = !comprehension(depth) && known;
            if (!accept(",")) {
                require(close);
                break;
            }
            comma = true;
        }
        if (!known)
            return other(first);
        if (!comma && result.list.size() == 1)
            return ConfigValue(std::move(result.list[0]));
        return result;
    }

    // A dictionary, or a set, which has no value here.
    ConfigValue braces(int depth)
    {
        const size_t first = m_next++;
        ConfigValue result;
        result.kind = Kind::Dict;
        bool known = true;
        while (!accept("}")) {
            if (accept("**")) {
                known = merge(expression(depth + 1), result) && known;
            } else {
                known = !accept("*") && known;
                ConfigValue key = expression(depth + 1);
                known = key.kind == Kind::String && known; // no name of a setting otherwise
                if (accept(":"))
                    result.add(std::move(key.text), expression(depth + 1));
                else
                    known = false;
                known = !comprehension(depth) && known;
            }
            if (!accept(",")) {
                require("}");
                break;
            }
        }
        return known ? result : other(first);
    }

    static bool merge(ConfigValue more, ConfigValue& into)
    {
        for (size_t i = 0; i < more.keys.size(); ++i)
            into.add(more.keys[i], std::move(more.list[i]));
        return more.kind == Kind::Dict;
    }

    // A function takes each name once. `last`: only the first keys of `given` count.
    void requireNew(const std::string& key, const ConfigValue& given, size_t last) const
    {
        const auto end = given.keys.begin() + ptrdiff_t(last);
        if (std::find(given.keys.begin(), end, key) != end)
            fail("'" + key.substr(0, 64) + "' given twice");
    }

    // (key=value, value, **{...}); values without a key are dropped, or refused where the function takes `only_named` ones.
    // `known` becomes false where keys are not known.
    ConfigValue arguments(int depth, bool only_named, bool& known)
    {
        ++m_next;
        ConfigValue result;
        result.kind = Kind::Dict;
        while (!accept(")")) {
            const size_t first = m_next, given = result.keys.size();
            if (accept("**")) {
                known = merge(expression(depth + 1), result) && known;
                for (size_t i = given; i < result.keys.size(); ++i)
                    requireNew(result.keys[i], result, given);
            } else if (at("=", 1)) {
                std::string key = name();
                ++m_next;
                requireNew(key, result, given);
                result.add(std::move(key), expression(depth + 1));
            } else {
                (void)accept("*");
                (void)expression(depth + 1);
                (void)comprehension(depth);
                if (only_named)
                    throwNoPython(m_file, "'" + other(first).text.substr(0, 64) + "' has no name", m_tokens[first].at);
            }
            if (!accept(",")) {
                require(")");
                break;
            }
        }
        return result;
    }

    void subscripts(int depth)
    {
        ++m_next;
        while (!accept("]"))
            if (!accept(",") && !accept(":") && !accept("*"))
                (void)expression(depth + 1);
    }

    std::string_view m_text;
    size_t m_after_atom = 0; // the token behind the atom that was read last
};

} // namespace

ConfigValue parsePythonNamespace(std::string_view text, const std::string& file)
{
    return ReprParser(text, file).run();
}

} // namespace gsc
