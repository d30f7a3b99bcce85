// SPDX-License-Identifier: Apache-2.0
// Rows and reports as JSON: a parser with limits, and Record, with which one describe() both writes the fields of a struct
// and reads them back, checked.
#pragma once

#include "runtime/cli/json.h"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// JSON of a row or a report from a hostile source. A text that nests too deep or has an object of too many keys is refused
// before it is built: to walk it could overflow the stack, and an object compares a key with all others.
struct ParsedRow {
    enum class State { Whole, NoJson, BeyondLimits };
    State state = State::Whole;
    OrderedJson json;  // null unless the text is whole
    std::string fault; // reason if it is not whole, such as "nests deeper than 16 levels"
};
ParsedRow parseRow(std::string_view text);

// Condition that a value must meet, and the words for it in a message.
struct FieldKind {
    bool (*fits)(const OrderedJson& value);
    const char* expected;
};

extern const FieldKind kText, kName, kFlag, kNumber, kPositive, kCount; // kName: not empty; kPositive: 0 too

// An object of JSON that is written or read, by one set of calls: a field is written from its value, or read into it.
class Record {
public:
    explicit Record(OrderedJson& out) : m_out(&out) {} // writes
    // Reads. `where` names the object in messages, such as "runs.jsonl:12"; `form` is the schema that it should have.
    // Reading throws Error(InvalidFile).
    Record(const OrderedJson& in, std::string where, const char* form = "gsc.run/2")
        : m_in(&in), m_where(std::move(where)), m_form(form)
    {
    }

    [[nodiscard]] Record object(const char* key) const;
    // True if an optional part is there: as `is_there` says when writing, as the JSON has it when reading.
    [[nodiscard]] bool hasPart(const char* key, bool is_there) const
    {
        return m_out != nullptr ? is_there : m_in->contains(m_at / key);
    }
    template <typename T>
    void part(const char* key, std::optional<T>& value) const
    {
        if (hasPart(key, value.has_value()))
            describe(object(key), value ? *value : value.emplace());
    }
    // True if an object that may be null is not: as `is_there` says when writing, as the JSON has it when reading.
    [[nodiscard]] bool hasObject(const char* key, bool is_there) const;

    template <typename T>
    void field(const char* key, T& value, const FieldKind& kind) const
    {
        if (m_out != nullptr)
            (*m_out)[m_at / key] = value;
        else
            take(key, value, kind);
    }
    // A field that may be null; null is the value `none`.
    template <typename T>
    void fieldOrNull(const char* key, T& value, const FieldKind& kind, const T& none = T()) const
    {
        if (m_out != nullptr)
            (*m_out)[m_at / key] = value == none ? OrderedJson() : OrderedJson(value);
        else if (read(key).is_null())
            value = none;
        else
            take(key, value, kind);
    }
    // An array of objects, each described by a describe() of its own.
    template <typename T>
    void objects(const char* key, std::vector<T>& values) const
    {
        if (m_out != nullptr) {
            OrderedJson list = OrderedJson::array();
            for (T& value : values)
                describe(Record(list.emplace_back(OrderedJson::object())), value);
            (*m_out)[m_at / key] = std::move(list);
            return;
        }
        const OrderedJson& list = read(key);
        check(key, list.is_array(), "an array");
        values.resize(list.size());
        for (size_t i = 0; i < list.size(); ++i) // each a record of its own: fields are looked up from its root
            describe(Record(list[i], m_where + ", " + key + "[" + std::to_string(i) + "]", m_form), values[i]);
    }
    // An array of numbers. A number that is not finite is written as null; null is read as `of_null`.
    void series(const char* key, std::vector<double>& values, double of_null) const;

    // Throws Error(InvalidFile) when reading, unless `good`.
    void check(const char* key, bool good, const std::string& expected) const;

private:
    using Pointer = OrderedJson::json_pointer;

    template <typename T>
    void take(const char* key, T& value, const FieldKind& kind) const
    {
        const OrderedJson& found = checked(key, kind);
        value = found.get<T>();
        if constexpr (std::is_integral_v<T>)
            check(key, found == value, kind.expected); // refuses a number beyond the range of T
    }
    [[nodiscard]] const OrderedJson& read(const char* key) const;
    [[nodiscard]] const OrderedJson& checked(const char* key, const FieldKind& kind) const;
    [[noreturn]] void fail(const Pointer& at, const std::string& expected) const;

    OrderedJson* m_out = nullptr;
    const OrderedJson* m_in = nullptr;
    Pointer m_at;
    std::string m_where;
    const char* m_form = "gsc.run/2";
};

} // namespace gsc
