// SPDX-License-Identifier: Apache-2.0
// Python's repr of a Namespace. A parser and not a split at commas: paths may hold any character (trap 35).
#include "convert/input/config/config_value.h"

#include "format/error.h"

#include <charconv>

namespace gsc {

namespace {

constexpr int kMaxDepth = 32;

bool isNameCharacter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || (c & 0x80) != 0;
}

void appendUtf8(std::string& out, uint32_t code)
{
    if (code < 0x80) {
        out += char(code);
        return;
    }
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3; // bytes behind the first
    out += char(0xf0 << (3 - more) | (code >> 6 * more & 0x3f >> more));
    for (int i = more; i-- > 0;)
        out += char(0x80 | (code >> 6 * i & 0x3f));
}

class ReprParser {
public:
    ReprParser(std::string_view text, const std::string& file) : m_text(text), m_file(file) {}

    ConfigValue run()
    {
        skipSpace();
        if (m_text.substr(m_cursor, 9) != "Namespace")
            fail("does not start with 'Namespace('");
        m_cursor += 9;
        ConfigValue value = arguments(0);
        skipSpace();
        if (m_cursor != m_text.size())
            fail("text after the closing bracket");
        return value;
    }

private:
    using Kind = ConfigValue::Kind;

    [[noreturn]] void fail(const std::string& text) const
    {
        throw Error(
            ErrorCode::InvalidFile,
            formatString("%s: %s at byte %zu, expected the line 'Namespace(...)' that the trainer wrote; restore "
                         "the file or remove it",
                         m_file.c_str(), text.c_str(), m_cursor));
    }

    [[nodiscard]] char peek() const { return m_cursor < m_text.size() ? m_text[m_cursor] : '\0'; }

    void skipSpace()
    {
        while (peek() == ' ' || peek() == '\n' || peek() == '\r' || peek() == '\t')
            ++m_cursor;
    }

    bool accept(char c)
    {
        skipSpace();
        if (peek() != c)
            return false;
        ++m_cursor;
        return true;
    }

    void require(char c)
    {
        if (!accept(c))
            fail(formatString("'%c' missing", c));
    }

    std::string name()
    {
        skipSpace();
        const size_t first = m_cursor;
        while (isNameCharacter(peek()))
            ++m_cursor;
        if (m_cursor == first)
            fail("name missing");
        return std::string(m_text.substr(first, m_cursor - first));
    }

    // What an opening bracket holds, up to `close`: `read_item` adds an item at the cursor to the result.
    template <typename ReadItem>
    ConfigValue items(Kind kind, char close, ReadItem&& read_item)
    {
        ConfigValue result;
        result.kind = kind;
        while (!accept(close)) {
            read_item(result);
            if (!accept(',')) {
                require(close);
                break;
            }
        }
        return result;
    }

    // (key=value, value, **{...}) after a class name; values without a key are dropped
    ConfigValue arguments(int depth)
    {
        require('(');
        return items(Kind::Dict, ')', [&](ConfigValue& result) {
            const size_t start = m_cursor;
            if (m_text.substr(m_cursor, 2) == "**") { // keys that are no identifiers
                m_cursor += 2;
                ConfigValue more = value(depth + 1);
                for (size_t i = 0; i < more.keys.size(); ++i)
                    result.add(more.keys[i], std::move(more.list[i]));
                return;
            }
            if (isNameCharacter(peek())) {
                std::string key = name();
                if (accept('='))
                    return result.add(std::move(key), value(depth + 1));
                m_cursor = start;
            }
            (void)value(depth + 1);
        });
    }

    ConfigValue sequence(char close, int depth)
    {
        ++m_cursor;
        return items(Kind::List, close, [&](ConfigValue& result) { result.list.push_back(value(depth + 1)); });
    }

    ConfigValue dictionary(int depth)
    {
        ++m_cursor;
        return items(Kind::Dict, '}', [&](ConfigValue& result) {
            ConfigValue key = value(depth + 1);
            require(':');
            result.add(std::move(key.text), value(depth + 1));
        });
    }

    ConfigValue value(int depth)
    {
        if (depth > kMaxDepth)
            fail(formatString("values nested deeper than %d", kMaxDepth));
        skipSpace();
        const char c = peek();
        if (c == '\'' || c == '"')
            return string();
        if (c == '[' || c == '(')
            return sequence(c == '[' ? ']' : ')', depth);
        if (c == '{')
            return dictionary(depth);
        if (c == '-' || c == '+' || c == '.' || (c >= '0' && c <= '9'))
            return number();
        if (c == '<')
            return angle();
        return word(depth);
    }

    ConfigValue string()
    {
        ConfigValue result;
        result.kind = Kind::String;
        const char quote = m_text[m_cursor++];
        while (peek() != quote) {
            if (m_cursor >= m_text.size())
                fail("string without an end");
            const char c = m_text[m_cursor++];
            if (c == '\\')
                escape(result.text);
            else
                result.text += c;
        }
        ++m_cursor;
        return result;
    }

    void escape(std::string& out)
    {
        const char c = peek();
        ++m_cursor;
        const char* const plain = "n\nt\tr\r\\\\'\'\"\"0\0";
        for (int i = 0; i < 14; i += 2)
            if (c == plain[i]) {
                out += plain[i + 1];
                return;
            }
        const size_t digits = c == 'x' ? 2 : c == 'u' ? 4 : c == 'U' ? 8 : 0;
        if (digits == 0 || m_cursor + digits > m_text.size())
            fail("escape sequence in a string is unknown");
        const char* first = m_text.data() + m_cursor;
        uint32_t code = 0;
        if (const auto [end, error] = std::from_chars(first, first + digits, code, 16);
            error != std::errc() || end != first + digits)
            fail("escape sequence in a string is broken");
        m_cursor += digits;
        appendUtf8(out, code);
    }

    ConfigValue number()
    {
        const size_t first = m_cursor;
        while (isNameCharacter(peek()) || peek() == '.' || peek() == '+' || peek() == '-')
            ++m_cursor;
        const std::string text(m_text.substr(first, m_cursor - first));
        ConfigValue result;
        if (!readNumber(text, result))
            fail("number '" + text.substr(0, 32) + "' is malformed");
        return result;
    }

    // the repr of an arbitrary object, "<...>"
    ConfigValue angle()
    {
        const size_t first = m_cursor;
        int open = 0;
        do {
            if (m_cursor >= m_text.size())
                fail("'<' without '>'");
            open += peek() == '<' ? 1 : peek() == '>' ? -1 : 0;
            ++m_cursor;
        } while (open > 0);
        ConfigValue result;
        result.kind = Kind::Other;
        result.text = m_text.substr(first, m_cursor - first);
        return result;
    }

    // None, True, False, inf, nan, or Class(...) such as PosixPath('x')
    ConfigValue word(int depth)
    {
        const size_t first = m_cursor;
        std::string text = name();
        ConfigValue result;
        if (text == "None")
            return result;
        if (text == "True" || text == "False") {
            result.kind = Kind::Bool;
            result.integer = text == "True";
            return result;
        }
        if ((text == "inf" || text == "nan") && readNumber(text, result))
            return result;
        while (peek() == '.') {
            ++m_cursor;
            (void)name();
        }
        skipSpace();
        if (peek() == '(')
            result = arguments(depth + 1);
        if (result.keys.empty()) {
            result = {};
            result.kind = Kind::Other;
            result.text = m_text.substr(first, m_cursor - first);
        }
        return result;
    }

    std::string_view m_text;
    const std::string& m_file;
    size_t m_cursor = 0;
};

} // namespace

ConfigValue parsePythonNamespace(std::string_view text, const std::string& file)
{
    return ReprParser(text, file).run();
}

} // namespace gsc
