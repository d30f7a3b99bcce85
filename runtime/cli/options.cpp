// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/options.h"

#include "runtime/cli/command_words.h"
#include "runtime/cli/quantity.h"
#include "runtime/cli/suggestion.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace gsc {

OptionHandle OptionHandle::required() const
{
    m_option->required();
    return *this;
}

OptionHandle OptionHandle::excludes(OptionHandle other) const
{
    m_option->excludes(other.get());
    return *this;
}

OptionHandle OptionHandle::needs(OptionHandle other) const
{
    m_option->needs(other.get());
    return *this;
}

OptionHandle OptionHandle::rare() const
{
    m_option->group(m_option->get_group() + kRare);
    return *this;
}

Heading::Heading(CLI::App& app, const std::string& name) : m_app(app)
{
    m_app.option_defaults()->group(name);
}

Heading::~Heading()
{
    m_app.option_defaults()->group("Options"); // CLI11's own
}

CLI::App& addCommand(CLI::App& parent, const std::string& name, const std::string& help)
{
    return *parent.add_subcommand(name, help)->footer(""); // not its parent's
}

void setFooter(CLI::App& app, const std::string& text)
{
    app.footer(text);
}

void takesCommand(CLI::App& app)
{
    app.require_subcommand(0, 1);
}

bool hasCommand(const CLI::App& app)
{
    return !app.get_subcommands().empty();
}

void onParsed(CLI::App& app, std::function<void()> act)
{
    app.callback(std::move(act));
}

OptionHandle optionOf(CLI::App& app, const char* name)
{
    return OptionHandle(app.get_option(name));
}

bool isGiven(const CLI::App& app, const char* name)
{
    const CLI::Option* option = app.get_option_no_throw(name);
    return option != nullptr && option->count() > 0;
}

namespace detail {

OptionHandle addValue(CLI::App& app, const std::string& names, const std::string& placeholder, const std::string& help,
                      std::function<void(const std::string&, const std::string&)> take, bool several)
{
    // messages name an option by the longest of its names
    const std::string shown = std::ranges::max(CLI::detail::split_names(names), {}, [](const std::string& name) {
        return std::pair(name[0] == '-', name.size());
    });
    CLI::Option* option = app.add_option(
        names,
        [shown, take = std::move(take)](const CLI::results_t& values) {
            for (const std::string& value : values)
                take(shown, value);
            return true;
        },
        help);
    option->option_text(placeholder);
    if (several)
        option->type_size(1)->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args();
    else
        option->expected(1);
    return OptionHandle(option);
}

void failValue(const std::string& name, const std::string& text, const char* found, const std::string& expected)
{
    throw Error(ErrorCode::Usage, formatString("%s %.80s", name.c_str(), text.c_str()), found, expected,
                "correct it or leave " + name + " out");
}

void failChoice(const std::string& name, const std::string& text, const std::vector<std::string>& words)
{
    const std::string near = nearestWord(text, words);
    throw Error(ErrorCode::Usage, formatString("%s %.80s", name.c_str(), text.c_str()), "not one of its values",
                listWords(words), near.empty() ? "pass one of these" : ("did you mean " + near + "?"));
}

double number(const std::string& name, const std::string& text, Range range, const char* unit)
{
    const std::string expected = range.open
                                     ? formatString("more than %g and less than %g%s", range.least, range.most, unit)
                                     : formatString("%g to %g%s", range.least, range.most, unit);
    double value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc::invalid_argument || stop != end || std::isnan(value))
        failValue(name, text, "no number", expected);
    const bool fits =
        range.open ? value > range.least && value < range.most : value >= range.least && value <= range.most;
    if (error != std::errc() || !fits)
        failValue(name, text, "out of range", expected);
    return value;
}

int64_t wholeNumber(const std::string& name, const std::string& text, int64_t least, int64_t most)
{
    const std::string expected = formatString("%lld to %lld", (long long)least, (long long)most);
    int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error != std::errc::invalid_argument && end == text.data() + text.size();
    if (!whole)
        failValue(name, text, "no whole number", expected);
    if (error == std::errc::result_out_of_range || value < least || value > most)
        failValue(name, text, "out of range", expected);
    return value;
}

} // namespace detail

OptionHandle addFlag(CLI::App& app, const std::string& names, bool& field, const std::string& help)
{
    return OptionHandle(app.add_flag(names, field, help));
}

OptionHandle addText(CLI::App& app, const std::string& names, std::string& field, const std::string& placeholder,
                     const std::string& help)
{
    return detail::addValue(app, names, placeholder, help,
                            [&field](const std::string&, const std::string& text) { field = text; });
}

OptionHandle addTexts(CLI::App& app, const std::string& names, std::vector<std::string>& field,
                      const std::string& placeholder, const std::string& help)
{
    return detail::addValue(
        app, names, placeholder, help, [&field](const std::string&, const std::string& text) { field.push_back(text); },
        true);
}

OptionHandle addByteSize(CLI::App& app, const std::string& names, uint64_t& field, uint64_t least,
                         const std::string& placeholder, const std::string& help)
{
    const auto take = [&field, least](const std::string& name, const std::string& text) {
        const auto value = parseByteSize(text);
        if (!value)
            detail::failValue(name, text, "no size", "bytes such as 512M or 4G");
        if (*value < least)
            detail::failValue(name, text, "too small", formatString("%llu bytes or more", (unsigned long long)least));
        field = *value;
    };
    return detail::addValue(app, names, placeholder, help, take);
}

OptionHandle addCount(CLI::App& app, const std::string& names, uint64_t& field, uint64_t least, uint64_t most,
                      const std::string& placeholder, const std::string& help)
{
    const auto take = [&field, least, most](const std::string& name, const std::string& text) {
        const std::string expected =
            formatString("%llu to %llu, such as 300k or 20M", (unsigned long long)least, (unsigned long long)most);
        const auto value = parseCount(text);
        if (!value)
            detail::failValue(name, text, "no whole number", expected);
        if (*value < least || *value > most)
            detail::failValue(name, text, "out of range", expected);
        field = *value;
    };
    return detail::addValue(app, names, placeholder, help, take);
}

OptionHandle addImageSize(CLI::App& app, const std::string& names, uint32_t& width, uint32_t& height,
                          const std::string& placeholder, const std::string& help, bool takes_width)
{
    const auto take = [&width, &height, takes_width](const std::string& name, const std::string& text) {
        const auto size = parseImageSize(text);
        if (!size || (size->height == 0 && !takes_width))
            detail::failValue(name, text, "no size",
                              std::string("width x height such as 1920x1080, each 1 to 32768, ") +
                                  (takes_width ? "a width, " : "") + "or rows such as 1080p");
        width = size->width;
        height = size->height;
    };
    return detail::addValue(app, names, placeholder, help, take);
}

} // namespace gsc
