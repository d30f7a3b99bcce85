// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/json_fields.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace gsc {

namespace {

constexpr int kMaxDepth = 64;     // deepest nesting of JSON; files that we read need four levels
constexpr double kMaxSize = 1e15; // largest coordinate: its square still fits a float
// Replaces NaN and the infinities in a text. null would not do: it may mean that a key is missing.
constexpr std::string_view kNotFiniteText = "1e308";
constexpr double kNotFinite = 1e308;

// Returns `text` with bare NaN, Infinity and -Infinity replaced by kNotFiniteText.
std::string withoutNonFinite(std::string_view text, const std::string& file, const char* expected)
{
    std::string out;
    out.reserve(text.size());
    bool in_string = false;
    int depth = 0;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            out += c;
            if (c == '\\' && i + 1 < text.size())
                out += text[++i];
            else if (c == '"')
                in_string = false;
            continue;
        }
        size_t skip = 0;
        for (const std::string_view word : {"NaN", "-NaN", "Infinity", "-Infinity"})
            if (text.substr(i, word.size()) == word)
                skip = word.size();
        if (skip > 0) {
            out += kNotFiniteText;
            i += skip - 1;
            continue;
        }
        in_string = c == '"';
        depth += (c == '[' || c == '{') - (c == ']' || c == '}');
        if (depth > kMaxDepth)
            throw Error(ErrorCode::InvalidFile, file,
                        formatString("nested deeper than %d levels at byte %zu", kMaxDepth, i), expected,
                        "check the file");
        out += c;
    }
    return out;
}

// Throws if an object has a key twice, because a parser would silently keep the last one. note: nlohmann's callback
// while parsing would tell the keys, too, but looks at a whole array for every object in it
class RefusedRepeats final : public ParsedJson::json_sax_t {
public:
    RefusedRepeats(const std::string& file, const char* expected) : m_file(file), m_expected(expected) {}

    bool start_object(size_t) override
    {
        if (++m_depth > m_keys.size())
            m_keys.emplace_back();
        m_keys[m_depth - 1].clear();
        return true;
    }
    bool key(string_t& name) override
    {
        if (!m_keys[m_depth - 1].insert(name).second)
            throw Error(ErrorCode::InvalidFile, m_file, "key " + shownJson(name) + " is there twice in one object",
                        m_expected, "leave one of them in");
        return true;
    }
    bool end_object() override
    {
        --m_depth;
        return true;
    }

    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_array(size_t) override { return true; }
    bool end_array() override { return true; }
    bool parse_error(size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

private:
    const std::string& m_file;
    const char* m_expected;
    std::vector<std::set<std::string>> m_keys; // for each object that is not closed yet: the keys read so far
    size_t m_depth = 0;
};

bool isPlainNumber(const ParsedJson& value)
{
    return value.is_number() && std::abs(value.get<double>()) <= kMaxSize; // also false for NaN
}

} // namespace

std::string shownJson(const ParsedJson& value)
{
    if (value.is_object())
        return "an object";
    if (value.is_array())
        return formatString("an array of %zu", value.size());
    if (value.is_number_float() && std::abs(value.get<double>()) >= kNotFinite)
        return "not finite";
    std::string text = value.dump(-1, ' ', true, ParsedJson::error_handler_t::replace);
    if (text.size() > 40)
        text = text.substr(0, 40) + "...";
    return text;
}

ParsedJson parseJson(std::string_view text, const std::string& file, const char* expected)
{
    const std::string clean = withoutNonFinite(text, file, expected);
    try {
        ParsedJson parsed = ParsedJson::parse(clean);
        RefusedRepeats repeats(file, expected);
        (void)ParsedJson::sax_parse(clean, &repeats);
        return parsed;
    } catch (const ParsedJson::exception& e) {
        // note: nlohmann's message begins with its own tag, "[json.exception.parse_error.101] ", and may quote any
        // bytes
        const char* tag = std::strchr(e.what(), ']');
        std::string what = std::string(tag ? tag + 2 : e.what()).substr(0, 200);
        for (char& c : what)
            if (c < 0x20 || c > 0x7e)
                c = '?';
        throw Error(ErrorCode::InvalidFile, file, "not valid JSON (" + what + ")", expected,
                    "correct it, or export the file again");
    }
}

JsonObject::JsonObject(const ParsedJson& value, std::string where) : m_value(value), m_where(std::move(where))
{
    if (!value.is_object())
        throw Error(ErrorCode::InvalidFile, m_where, "is " + shownJson(value), "an object",
                    "correct it, or export the file again");
}

std::vector<std::string> JsonObject::keys() const
{
    std::vector<std::string> keys;
    for (const auto& [key, value] : m_value.items())
        keys.push_back(key);
    return keys;
}

const ParsedJson* JsonObject::find(const char* key) const
{
    const auto it = m_value.find(key);
    return it == m_value.end() ? nullptr : &*it;
}

const ParsedJson* JsonObject::stated(const char* key) const
{
    const ParsedJson* const value = find(key);
    return value && value->is_null() ? nullptr : value;
}

const ParsedJson& JsonObject::at(const char* key) const
{
    const ParsedJson* value = find(key);
    if (!value)
        throw Error(ErrorCode::InvalidFile, m_where, formatString("key \"%s\" is missing", key),
                    "it in a file of this kind", "add it, or export it again");
    return *value;
}

void JsonObject::fail(const char* key, const std::string& found, const std::string& expected, const char* remedy) const
{
    throw Error(ErrorCode::InvalidFile, m_where, formatString("key \"%s\" is %s", key, found.c_str()), expected,
                remedy);
}

std::string JsonObject::text(const char* key) const
{
    const ParsedJson& value = at(key);
    if (!value.is_string())
        fail(key, shownJson(value), "a string");
    return value.get<std::string>();
}

double JsonObject::number(const char* key) const
{
    const ParsedJson& value = at(key);
    if (!isPlainNumber(value))
        fail(key, shownJson(value), "a finite number, at most 1e15 in size");
    return value.get<double>();
}

double JsonObject::positive(const char* key) const
{
    const double value = number(key);
    if (!(value > 0))
        fail(key, shownJson(at(key)), "a number above 0");
    return value;
}

int64_t JsonObject::integer(const char* key, int64_t smallest, int64_t largest) const
{
    // a float without a fraction is accepted: some exporters write 1920.0
    const double value = number(key);
    if (value != std::floor(value) || value < double(smallest) || value > double(largest))
        fail(key, shownJson(at(key)),
             formatString("an integer from %lld to %lld", static_cast<long long>(smallest),
                          static_cast<long long>(largest)));
    return int64_t(value);
}

void JsonObject::checkKeys(const std::vector<const char*>& known) const
{
    for (const auto& [key, value] : m_value.items()) {
        if (std::find(known.begin(), known.end(), key) != known.end())
            continue;
        std::string names;
        for (const char* name : known)
            names += (names.empty() ? "" : ", ") + std::string(name);
        throw Error(ErrorCode::InvalidFile, m_where, formatString("key \"%s\" is not known", key.substr(0, 40).c_str()),
                    "one of " + names, "correct or remove it");
    }
}

void JsonObject::numbers(const char* key, size_t count, double* out) const
{
    const ParsedJson& value = at(key);
    if (!value.is_array() || value.size() != count)
        fail(key, shownJson(value), formatString("an array of %zu numbers", count));
    for (size_t i = 0; i < count; ++i) {
        if (!isPlainNumber(value[i]))
            fail(key, formatString("%s at index %zu", shownJson(value[i]).c_str(), i),
                 formatString("%zu finite numbers", count));
        out[i] = value[i].get<double>();
    }
}

void JsonObject::matrix(const char* key, int rows, int columns, double* out) const
{
    const std::string expected = formatString("%d rows of %d finite numbers", rows, columns);
    const ParsedJson& value = at(key);
    if (!value.is_array() || value.size() != size_t(rows))
        fail(key, shownJson(value), expected);
    for (int r = 0; r < rows; ++r) {
        const ParsedJson& row = value[size_t(r)];
        if (!row.is_array() || row.size() != size_t(columns))
            fail(key, formatString("%s in row %d", shownJson(row).c_str(), r), expected);
        for (int c = 0; c < columns; ++c) {
            const ParsedJson& cell = row[size_t(c)];
            if (!isPlainNumber(cell))
                fail(key, formatString("%s in row %d, column %d", shownJson(cell).c_str(), r, c), expected);
            out[r * columns + c] = cell.get<double>();
        }
    }
}

} // namespace gsc
