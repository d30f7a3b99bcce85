// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/command_words.h"

#include <gsc/error.h>
#include "runtime/cli/suggestion.h"

#include <CLI/CLI.hpp>

#include <algorithm>

namespace gsc {

namespace {

std::vector<std::string> commandNames(const CLI::App& command)
{
    std::vector<std::string> names;
    for (const CLI::App* sub : commandsOf(command))
        names.push_back(sub->get_name());
    return names;
}

std::vector<std::string> longNames(const CLI::App& command)
{
    std::vector<std::string> names;
    for (const CLI::Option* option : optionsOf(command))
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    return names;
}

const CLI::App& rootOf(const CLI::App& command)
{
    const CLI::App* root = &command;
    while (root->get_parent() != nullptr)
        root = root->get_parent();
    return *root;
}

// Returns the first other command that has an option of this name; null if none has.
const CLI::App* ownerOf(const std::string& name, const CLI::App& command, const CLI::App& except)
{
    if (&command != &except && command.get_option_no_throw(name) != nullptr)
        return &command;
    for (const CLI::App* sub : commandsOf(command))
        if (const CLI::App* owner = ownerOf(name, *sub, except))
            return owner;
    return nullptr;
}

// Throws Error(Usage). `subject` is a word of the command line, which may be long and is cut.
[[noreturn]] void fail(const std::string& subject, const std::string& found, const std::string& expected,
                       const std::string& remedy)
{
    throw Error(ErrorCode::Usage, subject.substr(0, 80), found, expected, remedy);
}

std::string helpOf(const CLI::App& command)
{
    return commandPath(command) + " --help";
}

[[noreturn]] void failOption(const std::string& word, const CLI::App& command)
{
    const std::string name = word.substr(0, word.find('='));
    // a name that another command has is no misspelling of an option of this command
    const CLI::App* owner = ownerOf(name, rootOf(command), command);
    const std::string near = owner == nullptr ? nearestWord(name, longNames(command)) : "";
    const std::string hint = !near.empty()      ? "did you mean " + near + "?"
                             : owner != nullptr ? commandPath(*owner) + " has it; see " + helpOf(command)
                                                : "see " + helpOf(command);
    fail(name, "unknown option", "an option of " + commandPath(command), hint);
}

[[noreturn]] void failWord(const std::string& word, const CommandState& state)
{
    const CLI::App& command = *state.command;
    const std::string path = commandPath(command);
    if (state.positionals.empty() && !commandsOf(command).empty())
        failCommand(word, command);
    if (commandNamed(command, word) != nullptr)
        fail(word, "a command behind other words", "it right behind " + path,
             "put it there, or write ./" + word + " for a file of that name");
    if (!state.positionals.empty() && !nearestWord(state.positionals.front(), commandNames(command)).empty())
        failCommand(state.positionals.front(), command);
    const std::vector<const CLI::Option*> all = optionsOf(command);
    const auto most = std::count_if(all.begin(), all.end(), [](const CLI::Option* o) { return o->get_positional(); });
    fail(word, "one word too many",
         (most == 0 ? "options only" : std::to_string(most) + " and options") + " behind " + path,
         "see " + helpOf(command));
}

class Walker {
public:
    Walker(const CLI::App& root, bool lenient) : m_lenient(lenient) { m_state.command = &root; }

    void take(const std::string& word, size_t words_left)
    {
        if (m_state.awaited != nullptr) {
            const bool is_end =
                m_state.awaited_may_end && (looksLikeOption(word) || word == "--" || requiredLeft() >= words_left);
            if (!is_end) {
                takeValue(word);
                return;
            }
            m_state.awaited = nullptr;
            if (word == "--") // ends the list and nothing else
                return;
        }
        if (m_state.only_positionals)
            takePositional(word);
        else if (word == "--")
            m_state.only_positionals = true;
        else if (word.size() > 2 && word[0] == '-' && word[1] == '-')
            takeLong(word);
        else if (looksLikeOption(word))
            takeShort(word);
        else if (const CLI::App* sub = m_state.positionals.empty() ? commandNamed(*m_state.command, word) : nullptr)
            enter(*sub);
        else
            takePositional(word);
    }

    void finish()
    {
        const CommandState& state = m_state;
        if (state.help || state.version)
            return;
        if (state.awaited != nullptr && !state.awaited_may_end)
            failNoValue(*state.awaited);
        for (const CLI::Option* option : optionsOf(*state.command)) {
            const auto count = [&](const CLI::Option* other) {
                const auto found = state.given.find(other);
                return found == state.given.end() ? 0 : found->second;
            };
            const std::string name = optionName(*option);
            if (option->get_required() && count(option) == 0)
                failMissing(*option);
            if (count(option) == 0)
                continue;
            for (const CLI::Option* other : option->get_excludes())
                if (count(other) > 0)
                    fail(name, "together with " + optionName(*other), "one of the two", "leave one out");
            for (const CLI::Option* other : option->get_needs())
                if (count(other) == 0)
                    fail(name, "has no effect without " + optionName(*other), "both",
                         "pass " + optionName(*other) + " too or leave " + name + " out");
        }
    }

    [[nodiscard]] const CommandState& state() const { return m_state; }

private:
    [[nodiscard]] static bool isNumber(const std::string& word)
    {
        return word.size() > 1 && ((word[1] >= '0' && word[1] <= '9') || word[1] == '.');
    }
    [[nodiscard]] static bool looksLikeOption(const std::string& word)
    {
        return word.size() > 1 && word[0] == '-' && word != "--" && !isNumber(word);
    }
    [[nodiscard]] size_t requiredLeft() const
    {
        size_t left = 0;
        for (const CLI::Option* option : optionsOf(*m_state.command))
            left += option->get_positional() && option->get_required() && m_state.given.count(option) == 0;
        return left;
    }

    // Returns the name of the option that took more than one word, as lists do; empty if none did.
    [[nodiscard]] std::string listTaken() const
    {
        for (const auto& [option, count] : m_state.given) {
            const auto taken = std::ranges::count(m_state.values, option, &decltype(m_state.values)::value_type::first);
            if (!option->get_positional() && takesSeveral(*option) && size_t(taken) > count)
                return optionName(*option);
        }
        return "";
    }

    void enter(const CLI::App& sub)
    {
        if (!m_state.given.empty() && !m_lenient)
            fail(optionName(*m_state.given.begin()->first), "stands before the command " + commandPath(sub),
                 "behind it", "put it there");
        std::vector<std::string> path = std::move(m_state.path);
        path.push_back(sub.get_name());
        m_state = {};
        m_state.command = &sub;
        m_state.path = std::move(path);
    }

    [[noreturn]] void failMissing(const CLI::Option& option) const
    {
        const std::string path = commandPath(*m_state.command), name = optionName(option),
                          see = "see " + helpOf(*m_state.command);
        const std::string taker = listTaken();
        if (!option.get_positional())
            fail(name, "not given", name + " " + placeholderOf(option), see);
        const std::string word = option.get_name(true, false);
        if (taker.empty())
            fail(word, "not given", "it behind " + path, see);
        fail(word, "not given, because " + taker + " took every word behind it", "it before the options",
             "put it right behind " + path);
    }

    [[noreturn]] void failNoValue(const CLI::Option& option) const
    {
        const std::string name = optionName(option), placeholder = placeholderOf(option);
        fail(name, "no value given", name + " " + placeholder, "see " + helpOf(*m_state.command));
    }

    void note(const CLI::Option& option)
    {
        const size_t count = ++m_state.given[&option];
        if (count == 2 && takesValue(option) && !takesSeveral(option) && !m_lenient)
            fail(optionName(option), "given twice", "once", "leave one out");
        m_state.help_all |= &option == m_state.command->get_help_all_ptr();
        m_state.help |= m_state.help_all || &option == m_state.command->get_help_ptr();
        m_state.version |= &option == rootOf(*m_state.command).get_version_ptr();
        if (!takesValue(option))
            m_state.values.emplace_back(&option, "true");
    }

    void takeValue(const std::string& word, bool is_attached = false)
    {
        const CLI::Option& option = *m_state.awaited;
        // the word is the name of another option: the value of this one was forgotten
        if (!m_lenient && !is_attached && looksLikeOption(word) &&
            m_state.command->get_option_no_throw(word) != nullptr)
            failNoValue(option);
        if (word.empty() && !m_lenient)
            fail(optionName(option), "an empty value", placeholderOf(option),
                 "correct it or leave " + optionName(option) + " out");
        m_state.values.emplace_back(&option, word);
        if (takesSeveral(option) && !is_attached)
            m_state.awaited_may_end = true;
        else
            m_state.awaited = nullptr;
    }

    void takeLong(const std::string& word)
    {
        const size_t equals = word.find('=');
        const CLI::Option* option = m_state.command->get_option_no_throw(word.substr(0, equals));
        if (option == nullptr) {
            if (m_lenient)
                return;
            failOption(word, *m_state.command);
        }
        note(*option);
        m_state.awaited_may_end = false;
        if (equals == std::string::npos) {
            m_state.awaited = takesValue(*option) ? option : nullptr;
            return;
        }
        if (!takesValue(*option) && !m_lenient)
            fail(word, "a value behind a flag", optionName(*option) + " alone", "leave the value out");
        m_state.awaited = option;
        takeValue(word.substr(equals + 1), true);
    }

    // Takes a word of short options: -q, -vv, -qv, -oFILE.
    void takeShort(const std::string& word)
    {
        for (size_t i = 1; i < word.size(); ++i) {
            const CLI::Option* option = m_state.command->get_option_no_throw(std::string("-") + word[i]);
            if (option == nullptr) {
                if (m_lenient)
                    return;
                failOption(word, *m_state.command);
            }
            note(*option);
            if (!takesValue(*option))
                continue;
            m_state.awaited_may_end = false;
            m_state.awaited = option;
            if (i + 1 < word.size())
                takeValue(word.substr(i + 1), true);
            return;
        }
    }

    void takePositional(const std::string& word)
    {
        const CLI::Option* option = nextPositional(m_state);
        if (option == nullptr) {
            if (m_lenient)
                return;
            failWord(word, m_state);
        }
        if (word.empty() && !m_lenient)
            fail(option->get_name(true, false), "an empty word", placeholderOf(*option),
                 "see " + helpOf(*m_state.command));
        ++m_state.given[option];
        m_state.positionals.push_back(word);
        m_state.values.emplace_back(option, word);
    }

    CommandState m_state;
    bool m_lenient;
};

} // namespace

CommandState checkWords(const CLI::App& root, const std::vector<std::string>& words)
{
    Walker walker(root, false);
    for (size_t i = 0; i < words.size(); ++i)
        walker.take(words[i], words.size() - i);
    walker.finish();
    return walker.state();
}

void giveWords(CLI::App& root, const CommandState& state)
{
    CLI::App* command = &root;
    for (const std::string& name : state.path)
        command = command->get_subcommand(name);
    for (const auto& [option, value] : state.values)
        command->get_option(optionName(*option))->add_result(value);
    root.parse(std::vector<std::string>(state.path.rbegin(), state.path.rend())); // CLI11 runs the callbacks
}

CommandState followWords(const CLI::App& root, const std::vector<std::string>& words)
{
    Walker walker(root, true);
    for (const std::string& word : words)
        walker.take(word, words.size()); // the number of positionals has no limit here
    return walker.state();
}

std::vector<const CLI::App*> commandsOf(const CLI::App& command)
{
    return command.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> optionsOf(const CLI::App& command)
{
    return command.get_options([](const CLI::Option*) { return true; });
}

std::vector<OptionGroup> groupsOf(const CLI::App& command)
{
    std::vector<OptionGroup> groups;
    for (const CLI::Option* option : optionsOf(command)) {
        if (!option->nonpositional())
            continue;
        std::string name = option->get_group();
        if (isRare(*option))
            name.resize(name.size() - std::string(kRare).size());
        auto group = std::ranges::find(groups, name, &OptionGroup::name);
        if (group == groups.end())
            group = groups.insert(group, {name, {}});
        group->options.push_back(option);
    }
    return groups;
}

std::string topicOf(const OptionGroup& group)
{
    return CLI::detail::to_lower(group.name.substr(0, group.name.find(' ')));
}

const CLI::App* commandNamed(const CLI::App& command, const std::string& name)
{
    const std::vector<const CLI::App*> all = commandsOf(command);
    const auto found = std::ranges::find(all, name, &CLI::App::get_name);
    return found == all.end() ? nullptr : *found;
}

std::string listCommands(const CLI::App& command)
{
    return listWords(commandNames(command));
}

void failCommand(const std::string& word, const CLI::App& command)
{
    const std::string near = nearestWord(word, commandNames(command));
    fail(word, "no command of " + commandPath(command),
         commandsOf(command).empty() ? "none behind it" : listCommands(command),
         near.empty() ? "see " + helpOf(command) : "did you mean " + near + "?");
}

std::string commandPath(const CLI::App& command)
{
    const CLI::App* const parent = command.get_parent();
    return (parent != nullptr ? commandPath(*parent) + " " : "") + command.get_name();
}

std::string optionName(const CLI::Option& option)
{
    if (!option.get_lnames().empty())
        return "--" + option.get_lnames().front();
    return option.get_snames().empty() ? option.get_name(true, false) : "-" + option.get_snames().front();
}

bool isRare(const CLI::Option& option)
{
    return option.get_group().ends_with(kRare);
}

std::string positionalsText(const CLI::App& command)
{
    std::string words;
    for (const CLI::Option* option : optionsOf(command))
        if (option->get_positional()) {
            const std::string name = option->get_name(true, false) + (takesSeveral(*option) ? "..." : "");
            words += option->get_required() ? " " + name : " [" + name + "]";
        }
    return words;
}

std::string summaryOf(const std::string& help)
{
    return help.substr(0, std::min({help.find(": "), help.find("; "), help.find(". ")}));
}

bool takesValue(const CLI::Option& option)
{
    return option.get_items_expected_max() > 0;
}

bool takesSeveral(const CLI::Option& option)
{
    return option.get_items_expected_max() > 1;
}

const CLI::Option* nextPositional(const CommandState& state)
{
    for (const CLI::Option* option : optionsOf(*state.command))
        if (option->get_positional() && (takesSeveral(*option) || state.given.count(option) == 0))
            return option;
    return nullptr;
}

std::string noteOf(const CLI::Option& option)
{
    const std::string& text = option.get_option_text();
    return text.substr(std::min(text.find(" ("), text.size()));
}

std::string placeholderOf(const CLI::Option& option)
{
    const std::string& text = option.get_option_text();
    const std::string placeholder = text.substr(0, text.find(" ("));
    return placeholder.empty() || placeholder == " " ? option.get_name(true, false) : placeholder;
}

} // namespace gsc
