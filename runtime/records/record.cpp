// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/record.h"

#include <gsc/error.h>

#include <array>
#include <utility>

namespace gsc {

const FieldKind kText = {[](const OrderedJson& v) { return v.is_string(); }, "a text"};
const FieldKind kName = {[](const OrderedJson& v) { return v.is_string() && v != ""; }, "a text that is not empty"};
const FieldKind kFlag = {[](const OrderedJson& v) { return v.is_boolean(); }, "true or false"};
const FieldKind kNumber = {[](const OrderedJson& v) { return v.is_number() && std::isfinite(v.get<double>()); },
                           "a finite number"};
const FieldKind kPositive = {[](const OrderedJson& v) { return kNumber.fits(v) && v.get<double>() >= 0; },
                             "a number that is not negative"};
const FieldKind kCount = {[](const OrderedJson& v) { return v.is_number_unsigned(); },
                          "a whole number, 0 or more, in the range of the field"};

namespace {

constexpr size_t kMostRowDepth = 16; // reports reach 6
constexpr size_t kMostRowKeys = 100; // keys of one object; rows of a sweep have 25

// Checks the limits of a text of JSON while it is parsed, without building it.
class RowLimits : public nlohmann::json_sax<OrderedJson> {
public:
    [[nodiscard]] ParsedRow::State state() const { return m_state; }
    std::string fault;

    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_object(std::size_t) override { return begin(); }
    bool end_object() override { return end(); }
    bool start_array(std::size_t) override { return begin(); }
    bool end_array() override { return end(); }
    bool key(string_t&) override
    {
        return ++m_keys[m_depth - 1] <= kMostRowKeys ||
               stop(ParsedRow::State::BeyondLimits, formatString("has an object of more than %zu keys", kMostRowKeys));
    }
    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) override
    {
        return stop(ParsedRow::State::NoJson, std::string("is not JSON (") + error.what() + ")");
    }

private:
    bool begin()
    {
        if (m_depth == kMostRowDepth)
            return stop(ParsedRow::State::BeyondLimits, formatString("nests deeper than %zu levels", kMostRowDepth));
        m_keys[m_depth++] = 0;
        return true;
    }

    bool end()
    {
        --m_depth;
        return true;
    }

    bool stop(ParsedRow::State state, std::string text)
    {
        m_state = state;
        fault = std::move(text);
        return false;
    }

    ParsedRow::State m_state = ParsedRow::State::Whole;
    size_t m_depth = 0;
    std::array<size_t, kMostRowDepth> m_keys{}; // keys so far of each enclosing object
};

// Path of a value in a message, such as "per_frame.psnr[3]".
std::string dotted(OrderedJson::json_pointer at)
{
    if (at.empty())
        return {};
    const std::string last = at.back(), before = dotted(at.parent_pointer());
    if (std::isdigit(static_cast<unsigned char>(last[0])) != 0)
        return before + "[" + last + "]";
    return before.empty() ? last : before + "." + last;
}

} // namespace

ParsedRow parseRow(std::string_view text)
{
    RowLimits limits;
    const bool is_whole = OrderedJson::sax_parse(text, &limits);
    return {limits.state(), is_whole ? OrderedJson::parse(text) : OrderedJson(), std::move(limits.fault)};
}

Record Record::object(const char* key) const
{
    if (m_in != nullptr)
        (void)read(key);
    Record record = *this;
    record.m_at /= key;
    return record;
}

bool Record::hasObject(const char* key, bool is_there) const
{
    if (m_out != nullptr && !is_there)
        (*m_out)[m_at / key] = nullptr;
    return m_out != nullptr ? is_there : !read(key).is_null();
}

void Record::series(const char* key, std::vector<double>& values, double of_null) const
{
    if (m_out != nullptr) {
        OrderedJson list = OrderedJson::array();
        for (const double value : values)
            list.push_back(std::isfinite(value) ? OrderedJson(value) : OrderedJson());
        (*m_out)[m_at / key] = std::move(list);
        return;
    }
    const OrderedJson& list = read(key);
    check(key, list.is_array(), "an array");
    values.clear();
    for (const OrderedJson& value : list) {
        if (!value.is_null() && !kNumber.fits(value))
            fail(m_at / key / values.size(), kNumber.expected);
        values.push_back(value.is_null() ? of_null : value.get<double>());
    }
}

void Record::check(const char* key, bool good, const std::string& expected) const
{
    if (m_in != nullptr && !good)
        fail(m_at / key, expected);
}

const OrderedJson& Record::read(const char* key) const
{
    if (m_in->contains(m_at / key))
        return m_in->at(m_at / key);
    if (!m_in->at(m_at).is_object())
        fail(m_at, "an object");
    throw Error(ErrorCode::InvalidFile, m_where, "has no " + dotted(m_at / key),
                std::string("a whole line of ") + m_form, "remove the line or run it again");
}

const OrderedJson& Record::checked(const char* key, const FieldKind& kind) const
{
    const OrderedJson& value = read(key);
    check(key, kind.fits(value), kind.expected);
    return value;
}

void Record::fail(const Pointer& at, const std::string& expected) const
{
    std::string found = m_in->at(at).dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
    if (found.size() > 60)
        found = found.substr(0, 57) + "...";
    throw Error(ErrorCode::InvalidFile, m_where, dotted(at) + " is " + found, expected,
                "remove the line or run it again");
}

} // namespace gsc
