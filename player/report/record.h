// SPDX-License-Identifier: Apache-2.0
// The fields of a JSON object, described once: the same lines write it and read it back, checked.
#pragma once

#include "player/tool/json.h"

#include <cmath>
#include <string>
#include <vector>

namespace gsc {

// What a value may be, and how a message says so.
struct FieldKind {
    bool (*fits)(const OrderedJson& value);
    const char* expected;
};

extern const FieldKind kText, kName, kFlag, kNumber, kPositive, kCount; // kName: not empty; kPositive: 0 too

class Record {
public:
    explicit Record(OrderedJson& out) : m_out(&out) {}
    // `where` names the object in messages, such as "runs.jsonl:12". Reading throws Error(InvalidFile).
    Record(const OrderedJson& in, std::string where) : m_in(&in), m_where(std::move(where)) {}

    // Is there such a field? Where it writes, all are there. For what came with a later version.
    [[nodiscard]] bool has(const char* key) const { return m_out != nullptr || m_in->contains(m_at / key); }

    [[nodiscard]] Record object(const char* key) const;
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
    // Null is what is not finite, and read as `of_null`.
    void series(const char* key, std::vector<double>& values, double of_null) const;

    // Throws where it reads and the field is not `good`.
    void check(const char* key, bool good, const std::string& expected) const;
    // The same where there is a switch that is not off.
    void checkOff(const char* key, const std::string& expected) const;

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
};

} // namespace gsc
