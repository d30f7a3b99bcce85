// SPDX-License-Identifier: Apache-2.0
// Parses the text that Python prints of a Namespace. Splitting it at commas would not do, because paths may hold any
// character. The trainers give the file to eval(), so any Python expression must parse; literals become values, all
// else is kept as text.
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
// Reserved words of Python, which cannot be names.
constexpr std::string_view kReserved[] = {
    "and",      "as",     "assert",  "async", "await", "break",  "class", "continue", "def",  "del",  "elif",
    "else",     "except", "finally", "for",   "from",  "global", "if",    "import",   "in",   "is",   "lambda",
    "nonlocal", "not",    "or",      "pass",  "raise", "return", "try",   "while",    "with", "yield"};

// Reserved words of Python that are values.
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
        // the text is empty, or a single word that is no literal
        if (m_tokens.size() <= 2 && m_tokens[0].kind != PythonKind::Literal)
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
    // Returns the text from token `first` to the token before the current one as a value of kind Other.
    [[nodiscard]] ConfigValue other(size_t first) const
    {
        ConfigValue result;
        result.kind = Kind::Other;
        const PythonToken& last = m_tokens[m_next - 1];
        result.text = m_text.substr(m_tokens[first].at, last.at + last.text.size() - m_tokens[first].at);
        return result;
    }

    // Parses one expression. `conditional`: "a if b else c" is allowed; in a comprehension it is not, because "if"
    // starts a clause there.
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

    // Parses the parameters of a lambda, up to the colon.
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
        // true as long as the tokens since `first` are names joined by dots
        bool is_path = m_next == first + 1 && m_tokens[first].kind == PythonKind::Name;
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

    // Parses string literals: strings side by side are one string.
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

    // Parses the clauses behind the first item of a comprehension ("for x in y if z"); returns false if there are none.
    bool comprehension(int depth)
    {
        const bool found = at("for") || at("async");
        while (at("for") || at("async") || at("if")) {
            (void)accept("async");
            m_next += 1;
            do
                // "x in y" is parsed as a comparison, which looks alike
                (void)expression(depth + 1, false);
            while (accept(","));
        }
        return found;
    }

    // Parses a tuple or a list up to the bracket `close`. Round brackets round a single value without a comma give that
    // value.
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

    // Parses a dictionary, or a set, which is kept as text.
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
                // only a string can be the name of a setting
                known = key.kind == Kind::String && known;
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

    // Throws if `key` is among the first `last` keys of `given`: an argument can be given only once.
    void requireNew(const std::string& key, const ConfigValue& given, size_t last) const
    {
        const auto end = given.keys.begin() + ptrdiff_t(last);
        if (std::find(given.keys.begin(), end, key) != end)
            fail("'" + key.substr(0, 64) + "' given twice");
    }

    // Parses the arguments of a call: (key=value, value, **{...}). Values without a key are dropped; with `only_named`
    // they are refused. `known` becomes false if the keys cannot be known.
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
    // index of the token that follows the last atom read
    size_t m_after_atom = 0;
};

} // namespace

ConfigValue parsePythonNamespace(std::string_view text, const std::string& file)
{
    return ReprParser(text, file).run();
}

} // namespace gsc
