// SPDX-License-Identifier: Apache-2.0
// Rows and reports: their JSON, with limits, and its fields, described once: the same lines write them and read them
// back, checked.
#pragma once

#include "runtime/cli/json.h"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// The JSON of a row or a report that anyone may have written. A text that nests too deep or has an object of too many
// keys is refused before it is taken: to walk it could overflow the stack, and objects look through all keys for each.
struct ParsedRow {
    enum class State { Whole, NoJson, BeyondLimits };
    State state = State::Whole;
    OrderedJson json;  // of one that is whole, else null
    std::string fault; // of one that is not, such as "nests deeper than 16 levels"
};
ParsedRow parseRow(std::string_view text);

// Condition that a value must meet, and how a message says so.
struct FieldKind {
    bool (*fits)(const OrderedJson& value);
    const char* expected;
};

extern const FieldKind kText, kName, kFlag, kNumber, kPositive, kCount; // kName: not empty; kPositive: 0 too

class Record {
public:
    explicit Record(OrderedJson& out) : m_out(&out) {}
    // `where` names the object in messages, such as "runs.jsonl:12"; `form` is what it should be. Reading throws
    // Error(InvalidFile).
    Record(const OrderedJson& in, std::string where, const char* form = "gsc.run/2")
        : m_in(&in), m_where(std::move(where)), m_form(form)
    {
    }

    [[nodiscard]] Record object(const char* key) const;
    // A part that only some have: is it there? Where it writes, `is_there` says so.
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
    // One that may be null: is it there? Where it writes, `is_there` says so.
    [[nodiscard]] bool hasObject(const char* key, bool is_there) const;

    template <typename T>
    void field(const char* key, T& value, const FieldKind& kind) const
    {
        if (m_out != nullptr)
            (*m_out)[m_at / key] = value;
        else
            take(key, value, kind);
    }
    // `none` stands for null.
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
        for (size_t i = 0; i < list.size(); ++i) // each a record of its own: its fields are found from there
            describe(Record(list[i], m_where + ", " + key + "[" + std::to_string(i) + "]", m_form), values[i]);
    }
    // Null is what is not finite, and read as `of_null`.
    void series(const char* key, std::vector<double>& values, double of_null) const;

    // Throws where it reads and the field is not `good`.
    void check(const char* key, bool good, const std::string& expected) const;

private:
    using Pointer = OrderedJson::json_pointer;

    template <typename T>
    void take(const char* key, T& value, const FieldKind& kind) const
    {
        const OrderedJson& found = checked(key, kind);
        value = found.get<T>();
        if constexpr (std::is_integral_v<T>)
            check(key, found == value, kind.expected); // or it is beyond the type
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
