// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/python_tokens.h"

#include <gsc/error.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <limits>

namespace gsc {

namespace {

using Kind = ConfigValue::Kind;

constexpr int kMaxBrackets = 200; // Python's own limit of nested brackets

// Operators of Python, longer ones first, so that the first match is the longest.
constexpr std::string_view kOperators[] = {"**=", "//=", ">>=", "<<=", "...", "**", "//", ">>", "<<", "<=", ">=", "==",
                                           "!=",  "->",  ":=",  "+=",  "-=",  "*=", "/=", "%=", "&=", "|=", "^=", "@="};
constexpr std::string_view kSingle = "+-*/%@&|^~<>()[]{},:.;=";

bool isDigit(char c)
{
    return c >= '0' && c <= '9';
}

// Returns true for a letter, a digit or an underscore of ASCII. Python allows letters of every script in names, but no
// setting has them, and characters that look like letters or blanks would go unnoticed.
bool isNameCharacter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || isDigit(c) || c == '_';
}

void appendUtf8(std::string& out, uint32_t code)
{
    if (code < 0x80) {
        out += char(code);
        return;
    }
    // Python's code for a byte of a file name that was not UTF-8
    if (code >= 0xdc80 && code <= 0xdcff) {
        out += char(code - 0xdc00);
        return;
    }
    if (code >= 0xd800 && code <= 0xdfff)
        code = 0xfffd;
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3; // bytes that follow the first byte
    out += char(0xf0 << (3 - more) | (code >> 6 * more & 0x3f >> more));
    for (int i = more; i-- > 0;)
        out += char(0x80 | (code >> 6 * i & 0x3f));
}

class Tokenizer {
public:
    Tokenizer(std::string_view text, const std::string& file) : m_text(text), m_file(file) {}

    std::vector<PythonToken> run()
    {
        for (skipSpace(); m_cursor < m_text.size(); skipSpace()) {
            m_at = m_cursor;
            PythonToken token = next();
            token.at = m_at;
            token.text = m_text.substr(m_at, m_cursor - m_at);
            m_tokens.push_back(std::move(token));
        }
        m_tokens.push_back({PythonKind::End, m_text.size(), {}, {}});
        return std::move(m_tokens);
    }

private:
    [[noreturn]] void fail(const std::string& found) const { throwNoPython(m_file, found, m_cursor); }

    [[nodiscard]] char peek(size_t ahead = 0) const
    {
        return m_cursor + ahead < m_text.size() ? m_text[m_cursor + ahead] : '\0';
    }

    // Skips spaces, line ends, comments, and a backslash at the end of a line.
    void skipSpace()
    {
        while (m_cursor < m_text.size()) {
            const char c = m_text[m_cursor];
            if (c == '#')
                m_cursor = std::min(m_text.find('\n', m_cursor), m_text.size());
            else if (c == '\\' && (peek(1) == '\n' || (peek(1) == '\r' && peek(2) == '\n')))
                m_cursor += peek(1) == '\r' ? 3 : 2;
            else if (std::string_view(" \t\r\n\f").find(c) != std::string_view::npos)
                ++m_cursor;
            else
                return;
        }
    }

    PythonToken next()
    {
        const char c = peek();
        if (const size_t prefix = stringPrefix(); prefix != std::string_view::npos)
            return literal(string(prefix));
        if (isDigit(c) || (c == '.' && isDigit(peek(1))))
            return literal(number());
        if (isNameCharacter(c)) {
            while (isNameCharacter(peek()))
                ++m_cursor;
            return {PythonKind::Name, 0, {}, {}};
        }
        if (c == '<' && wantsValue())
            return literal(angle());
        return operation();
    }

    static PythonToken literal(ConfigValue value) { return {PythonKind::Literal, 0, {}, std::move(value)}; }

    [[nodiscard]] bool wantsValue() const
    {
        return m_tokens.empty() || (m_tokens.back().kind == PythonKind::Operator &&
                                    std::string_view("([{,:=").find(m_tokens.back().text) != std::string_view::npos);
    }

    PythonToken operation()
    {
        const std::string_view rest = m_text.substr(m_cursor);
        const auto found = std::ranges::find_if(kOperators, [&](std::string_view o) { return rest.starts_with(o); });
        if (found == std::end(kOperators) && kSingle.find(rest[0]) == std::string_view::npos)
            fail("does not take " + characterName(m_text, m_cursor));
        m_brackets += std::string_view("([{").find(rest[0]) != std::string_view::npos;
        m_brackets -= std::string_view(")]}").find(rest[0]) != std::string_view::npos;
        if (m_brackets > kMaxBrackets)
            fail(formatString("more than %d open brackets", kMaxBrackets));
        m_cursor += found == std::end(kOperators) ? 1 : found->size();
        return {PythonKind::Operator, 0, {}, {}};
    }

    // Number of letters before the quote of a string (such as r or f) if one starts here; else npos.
    [[nodiscard]] size_t stringPrefix() const
    {
        size_t letters = 0;
        while (letters < 3 && std::string_view("rRbBuUfFtT").find(peek(letters)) != std::string_view::npos &&
               peek(letters) != '\0')
            ++letters;
        return letters < 3 && (peek(letters) == '\'' || peek(letters) == '"') ? letters : std::string_view::npos;
    }

    ConfigValue string(size_t prefix)
    {
        const std::string_view letters = m_text.substr(m_cursor, prefix);
        const bool raw = letters.find_first_of("rR") != std::string_view::npos;
        m_cursor += prefix;
        const char quote = peek();
        const bool triple = peek(1) == quote && peek(2) == quote;
        const std::string_view end = triple ? m_text.substr(m_cursor, 3) : m_text.substr(m_cursor, 1);
        m_cursor += end.size();
        ConfigValue result;
        // bytes (b), f-strings (f) and template strings (t) have no text that could be known here
        result.kind = letters.find_first_of("bBfFtT") != std::string_view::npos ? Kind::Other : Kind::String;
        for (;;) {
            // after a backslash there has to be another character
            if (m_cursor + (peek() == '\\' ? 1 : 0) >= m_text.size() || (!triple && peek() == '\n'))
                fail("string without an end");
            if (m_text.substr(m_cursor, end.size()) == end)
                break;
            const char c = m_text[m_cursor++];
            if (c != '\\')
                result.text += c;
            else if (raw)
                result.text.append(1, c).append(m_text.substr(m_cursor++, 1));
            else
                escape(result);
        }
        m_cursor += end.size();
        return result;
    }

    void escape(ConfigValue& result)
    {
        const char c = m_text[m_cursor++];
        constexpr std::string_view plain = "n\nt\tr\r\\\\''\"\"a\ab\bf\fv\v";
        for (size_t i = 0; i < plain.size(); i += 2)
            if (c == plain[i]) {
                result.text += plain[i + 1];
                return;
            }
        if (c == '\r' || c == '\n') { // a backslash at the end of a line: both are dropped
            m_cursor += c == '\r' && peek() == '\n';
        } else if (c >= '0' && c <= '7') {
            uint32_t code = uint32_t(c - '0');
            for (int i = 0; i < 2 && peek() >= '0' && peek() <= '7'; ++i)
                code = code * 8 + uint32_t(m_text[m_cursor++] - '0');
            appendUtf8(result.text, code);
        } else if (c == 'x' || c == 'u' || c == 'U') {
            appendUtf8(result.text, hexadecimal(c == 'x' ? 2 : c == 'u' ? 4 : 8));
        } else if (c == 'N') { // \N{name}: a character by its Unicode name, not looked up here
            const size_t end = peek() == '{' ? m_text.find('}', m_cursor) : std::string_view::npos;
            if (end == std::string_view::npos)
                fail("escape sequence in a string is broken");
            m_cursor = end + 1;
            result.kind = Kind::Other;
        } else { // Python keeps a backslash before any other character
            result.text += '\\';
            result.text += c;
        }
    }

    uint32_t hexadecimal(size_t digits)
    {
        const std::string_view text = m_text.substr(m_cursor, digits);
        uint32_t code = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), code, 16);
        if (text.size() != digits || error != std::errc() || end != text.data() + digits || code > 0x10ffff)
            fail("escape sequence in a string is broken");
        m_cursor += digits;
        return code;
    }

    // Reads the digits of a number in this base and drops single underscores between them.
    std::string digits(int base)
    {
        std::string text;
        const auto isOne = [&](char c) {
            const int value = isDigit(c)             ? c - '0'
                              : c >= 'a' && c <= 'f' ? c - 'a' + 10
                              : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                     : 99;
            return value < base;
        };
        while (isOne(peek()) || (peek() == '_' && isOne(peek(1)) && (!text.empty() || base != 10))) {
            if (peek() != '_')
                text += peek();
            ++m_cursor;
        }
        return text;
    }

    ConfigValue number()
    {
        const char letter = peek() == '0' ? char(peek(1) | 0x20) : '\0';
        const int base = letter == 'x' ? 16 : letter == 'o' ? 8 : letter == 'b' ? 2 : 10;
        ConfigValue result;
        if (base != 10) {
            m_cursor += 2;
            const std::string text = digits(base);
            if (text.empty() || isNameCharacter(peek()))
                fail("a number that is none");
            setInteger(text, base, result);
            return result;
        }
        std::string text = digits(10);
        bool whole = true;
        if (peek() == '.') {
            whole = false;
            ++m_cursor;
            text += '.' + digits(10);
        }
        if (const size_t sign = peek(1) == '+' || peek(1) == '-' ? 1 : 0;
            (peek() == 'e' || peek() == 'E') && isDigit(peek(1 + sign))) {
            whole = false;
            text += m_text.substr(m_cursor, 1 + sign);
            m_cursor += 1 + sign;
            text += digits(10);
        }
        const bool imaginary = peek() == 'j' || peek() == 'J';
        m_cursor += imaginary;
        const bool leading = whole && !imaginary && text.size() > 1 && text[0] == '0' &&
                             text.find_first_not_of('0') != std::string::npos;
        if (isNameCharacter(peek()) || leading)
            fail("a number that is none");
        if (imaginary)
            result.kind = Kind::Other;
        else if (whole)
            setInteger(text, 10, result);
        else
            (void)readNumber(text, result);
        return result;
    }

    static void setInteger(const std::string& text, int base, ConfigValue& result)
    {
        result.kind = Kind::Int;
        for (const char c : text)
            result.number = result.number * base + (isDigit(c) ? c - '0' : (c | 0x20) - 'a' + 10);
        if (base == 10)
            result.number = std::strtod(text.c_str(), nullptr);
        if (std::from_chars(text.data(), text.data() + text.size(), result.integer, base).ec != std::errc())
            result.integer = std::numeric_limits<int64_t>::max();
    }

    // Reads "<...>", the text that Python prints of an object that has no other text.
    ConfigValue angle()
    {
        int open = 0;
        do {
            if (m_cursor >= m_text.size())
                fail("'<' without '>'");
            open += peek() == '<' ? 1 : peek() == '>' ? -1 : 0;
            ++m_cursor;
        } while (open > 0);
        ConfigValue result;
        result.kind = Kind::Other;
        return result;
    }

    std::string_view m_text;
    const std::string& m_file;
    size_t m_cursor = 0;
    size_t m_at = 0; // byte offset of the token that is being read
    int m_brackets = 0;
    std::vector<PythonToken> m_tokens;
};

} // namespace

std::vector<PythonToken> pythonTokens(std::string_view text, const std::string& file)
{
    return Tokenizer(text, file).run();
}

void throwNoPython(const std::string& file, const std::string& found, size_t at)
{
    throw Error(ErrorCode::InvalidFile, file, formatString("%s at byte %zu", found.c_str(), at),
                "the line 'Namespace(...)' that the trainer wrote", "restore the file or remove it");
}

} // namespace gsc
