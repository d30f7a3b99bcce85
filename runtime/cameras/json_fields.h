// SPDX-License-Identifier: Apache-2.0
// Hostile JSON to checked values; every message names the file, the place and the key.
#pragma once

#include <gsc/error.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

using ParsedJson = nlohmann::json;

constexpr uint32_t kMaxImageSide = 32768; // pixels

// Parses `text`; NaN and Infinity, which Python's json module writes, become a number larger than any that is taken, so
// that they only matter where a value is needed. `expected` is what the file should have been, for the message. Throws Error(InvalidFile), also for
// nesting deeper than any file we read has and for a key that an object has twice.
ParsedJson parseJson(std::string_view text, const std::string& file, const char* expected = "a camera file");

// A value as a message quotes it, cut to a few words.
std::string shownJson(const ParsedJson& value);

// One object of a file, with the words that say where it is: "cameras.json: entry 3".
class JsonObject {
public:
    // Throws Error(InvalidFile) if `value` is no object. `value` must outlive this.
    JsonObject(const ParsedJson& value, std::string where);

    [[nodiscard]] const std::string& where() const { return m_where; }
    void setWhere(std::string where) { m_where = std::move(where); }
    [[nodiscard]] std::vector<std::string> keys() const;

    // Null if the key is missing.
    [[nodiscard]] const ParsedJson* find(const char* key) const;
    [[nodiscard]] bool has(const char* key) const { return find(key) != nullptr; }
    // find() for keys that may be left out: null too if the value is null, as Python writes None.
    [[nodiscard]] const ParsedJson* stated(const char* key) const;

    // All throw Error(InvalidFile) if the key is missing or its value is of another kind than the function's name says.
    [[nodiscard]] const ParsedJson& at(const char* key) const;
    [[nodiscard]] std::string text(const char* key) const;
    [[nodiscard]] double number(const char* key) const; // finite
    [[nodiscard]] double positive(const char* key) const;
    [[nodiscard]] int64_t integer(const char* key, int64_t smallest, int64_t largest) const;
    [[nodiscard]] uint32_t imageSide(const char* key) const { return uint32_t(integer(key, 1, kMaxImageSide)); }
    // Every key must be one of `known`.
    void checkKeys(const std::vector<const char*>& known) const;
    void numbers(const char* key, size_t count, double* out) const; // an array of them
    void vector3(const char* key, double out[3]) const { numbers(key, 3, out); }
    // `rows` arrays of `columns` numbers, row-major into `out`.
    void matrix(const char* key, int rows, int columns, double* out) const;

    [[noreturn]] void fail(const char* key, const std::string& found, const std::string& expected,
                           const char* remedy = "correct it, or export the file again") const;

private:
    const ParsedJson& m_value;
    std::string m_where;
};

} // namespace gsc
