// SPDX-License-Identifier: Apache-2.0
// Declares the options of commands for both programs. Every value is checked as it is read: a wrong one throws
// Error(Usage) that names the option, what was found, what was expected and what to do.
//
// `placeholder` is the text behind an option's name in the help and the manual page. Shells complete values by it:
// lower-case words separated by | are the values themselves, FILE.gsc, FILE and DIR are names of files (completion.h).
#pragma once

#include <gsc/error.h>

#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace gsc {

// A declared option. CLI11's headers, which take seconds to compile, stay in runtime/cli.
class OptionHandle {
public:
    explicit OptionHandle(CLI::Option* option) : m_option(option) {}

    OptionHandle required() const;
    OptionHandle excludes(OptionHandle other) const;
    OptionHandle needs(OptionHandle other) const;
    OptionHandle rare() const; // leaves the option out of --help; --help-all and the page of its heading show it
    [[nodiscard]] CLI::Option* get() const { return m_option; }

private:
    CLI::Option* m_option;
};

// While a Heading exists, declared options stand under `name` in the help. The first word of `name` is also the word
// that `help` takes for them, such as "reuse" of `help reuse`.
class Heading {
public:
    Heading(CLI::App& app, const std::string& name);
    ~Heading();
    Heading(const Heading&) = delete;
    Heading& operator=(const Heading&) = delete;

private:
    CLI::App& m_app;
};

// Adds a command below `parent`; `help` describes it.
CLI::App& addCommand(CLI::App& parent, const std::string& name, const std::string& help);
void setFooter(CLI::App& app, const std::string& text);
void takesCommand(CLI::App& app);     // makes `app` accept one command below it
bool hasCommand(const CLI::App& app); // call after parsing: returns true if a command below `app` was given
void onParsed(CLI::App& app, std::function<void()> act);
OptionHandle optionOf(CLI::App& app, const char* name); // returns an option that was declared before
// call after parsing; returns false also if the command has no such option
bool isGiven(const CLI::App& app, const char* name);

// Range of numbers that an option takes, from `least` to `most`.
struct Range {
    double least = 0, most = 0;
    bool open = false; // true: `least` and `most` themselves are not allowed
};

OptionHandle addFlag(CLI::App& app, const std::string& names, bool& field, const std::string& help);
OptionHandle addText(CLI::App& app, const std::string& names, std::string& field, const std::string& placeholder,
                     const std::string& help);
// Adds an option that may be given several times, or take several words.
OptionHandle addTexts(CLI::App& app, const std::string& names, std::vector<std::string>& field,
                      const std::string& placeholder, const std::string& help);
// Adds an option that takes a number of bytes, such as "8G", of at least `least`.
OptionHandle addByteSize(CLI::App& app, const std::string& names, uint64_t& field, uint64_t least,
                         const std::string& placeholder, const std::string& help);
// Adds an option that takes a count, such as "20M", from `least` to `most`.
OptionHandle addCount(CLI::App& app, const std::string& names, uint64_t& field, uint64_t least, uint64_t most,
                      const std::string& placeholder, const std::string& help);
// Adds an option that takes a size in pixels: "1920x1080", "1080p", or with `takes_width` "1280", whose height is 0.
OptionHandle addImageSize(CLI::App& app, const std::string& names, uint32_t& width, uint32_t& height,
                          const std::string& placeholder, const std::string& help, bool takes_width = false);

namespace detail {

// Adds an option that calls `take` for each value. It may be given once only, unless `several`.
OptionHandle addValue(CLI::App& app, const std::string& names, const std::string& placeholder, const std::string& help,
                      std::function<void(const std::string& name, const std::string& text)> take, bool several = false);
// Throws Error(Usage) for a wrong value. `name` is the option's longest name, "--fov".
[[noreturn]] void failValue(const std::string& name, const std::string& text, const char* found,
                            const std::string& expected);
double number(const std::string& name, const std::string& text, Range range, const char* unit);
int64_t wholeNumber(const std::string& name, const std::string& text, int64_t least, int64_t most);
[[noreturn]] void failChoice(const std::string& name, const std::string& text, const std::vector<std::string>& words);

} // namespace detail

// Adds an option that takes a decimal integer from `least` to `most`.
template <typename Integer>
OptionHandle addInteger(CLI::App& app, const std::string& names, Integer& field, int64_t least, int64_t most,
                        const std::string& placeholder, const std::string& help)
{
    static_assert(std::is_integral_v<Integer>);
    return detail::addValue(app, names, placeholder, help,
                            [&field, least, most](const std::string& name, const std::string& text) {
                                field = Integer(detail::wholeNumber(name, text, least, most));
                            });
}

// Adds an option that takes a finite decimal number. `unit` stands behind numbers in messages, such as " degrees".
template <typename Float>
OptionHandle addNumber(CLI::App& app, const std::string& names, Float& field, Range range, const char* unit,
                       const std::string& placeholder, const std::string& help)
{
    static_assert(std::is_floating_point_v<Float>);
    return detail::addValue(app, names, placeholder, help,
                            [&field, range, unit](const std::string& name, const std::string& text) {
                                field = Float(detail::number(name, text, range, unit));
                            });
}

template <typename Value>
using Choices = std::vector<std::pair<std::string, Value>>;

// Adds an option that takes one of a few words; they are its placeholder, in the given order. `note` follows in
// brackets.
template <typename Value>
OptionHandle addChoice(CLI::App& app, const std::string& names, Value& field, Choices<Value> choices,
                       const std::string& note, const std::string& help)
{
    std::vector<std::string> words;
    std::string placeholder;
    for (const auto& [word, value] : choices) {
        words.push_back(word);
        placeholder += (placeholder.empty() ? "" : "|") + word;
    }
    return detail::addValue(app, names, placeholder + (note.empty() ? "" : " (" + note + ")"), help,
                            [&field, choices = std::move(choices), words = std::move(words)](const std::string& name,
                                                                                             const std::string& text) {
                                for (const auto& [word, value] : choices)
                                    if (word == text) {
                                        field = value;
                                        return;
                                    }
                                detail::failChoice(name, text, words);
                            });
}

} // namespace gsc
