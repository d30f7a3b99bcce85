// SPDX-License-Identifier: Apache-2.0
// Checks values of hostile JSON. Every message names the file, the place in it and the key.
#pragma once

#include <gsc/error.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

using ParsedJson = nlohmann::json;

constexpr uint32_t kMaxImageSide = 32768; // largest width and height of an image, pixels

// Parses `text`. NaN and Infinity, which Python's json module writes, become a number larger than any that is
// accepted, so that they only fail where the value is read. `expected` describes the right kind of file for the
// message. Throws Error(InvalidFile), also if the nesting is deeper than in any file that we read, and if an object
// has a key twice.
ParsedJson parseJson(std::string_view text, const std::string& file, const char* expected = "a camera file");

// Returns a value as a message quotes it, cut to a few words.
std::string shownJson(const ParsedJson& value);

// One object of a JSON file, with the place that messages name: "cameras.json: entry 3".
class JsonObject {
public:
    // Throws Error(InvalidFile) if `value` is no object. `value` must outlive this object.
    JsonObject(const ParsedJson& value, std::string where);

    [[nodiscard]] const std::string& where() const { return m_where; }
    void setWhere(std::string where) { m_where = std::move(where); }
    [[nodiscard]] std::vector<std::string> keys() const;

    // Returns the value of a key; null if the key is missing.
    [[nodiscard]] const ParsedJson* find(const char* key) const;
    [[nodiscard]] bool has(const char* key) const { return find(key) != nullptr; }
    // Returns find(key), but null also if the value is null, which Python writes for None.
    [[nodiscard]] const ParsedJson* stated(const char* key) const;

    // The functions below throw Error(InvalidFile) if the key is missing or its value is not of the kind that the
    // function's name says.
    [[nodiscard]] const ParsedJson& at(const char* key) const;
    [[nodiscard]] std::string text(const char* key) const;
    [[nodiscard]] double number(const char* key) const; // returns a finite number
    [[nodiscard]] double positive(const char* key) const;
    [[nodiscard]] int64_t integer(const char* key, int64_t smallest, int64_t largest) const;
    [[nodiscard]] uint32_t imageSide(const char* key) const { return uint32_t(integer(key, 1, kMaxImageSide)); }
    // Throws Error(InvalidFile) if the object has a key that is not in `known`.
    void checkKeys(const std::vector<const char*>& known) const;
    void numbers(const char* key, size_t count, double* out) const; // reads an array of `count` numbers
    void vector3(const char* key, double out[3]) const { numbers(key, 3, out); }
    // Reads `rows` arrays of `columns` numbers into `out`, row by row.
    void matrix(const char* key, int rows, int columns, double* out) const;

    [[noreturn]] void fail(const char* key, const std::string& found, const std::string& expected,
                           const char* remedy = "correct it, or export the file again") const;

private:
    const ParsedJson& m_value;
    std::string m_where;
};

} // namespace gsc
