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

// The first other command that has an option of this name; null if none has.
const CLI::App* ownerOf(const std::string& name, const CLI::App& command, const CLI::App& except)
{
    if (&command != &except && command.get_option_no_throw(name) != nullptr)
        return &command;
    for (const CLI::App* sub : commandsOf(command))
        if (const CLI::App* owner = ownerOf(name, *sub, except))
            return owner;
    return nullptr;
}

[[noreturn]] void fail(const std::string& what)
{
    throw Error(ErrorCode::Usage, what);
}

std::string helpOf(const CLI::App& command)
{
    return commandPath(command) + " --help";
}

[[noreturn]] void failOption(const std::string& word, const CLI::App& command)
{
    const std::string name = word.substr(0, word.find('='));
    // the very word of another command is no misspelling of one of these
    const CLI::App* owner = ownerOf(name, rootOf(command), command);
    const std::string near = owner == nullptr ? nearestWord(name, longNames(command)) : "";
    const std::string hint = !near.empty()      ? "did you mean " + near + "?"
                             : owner != nullptr ? commandPath(*owner) + " has it; see " + helpOf(command)
                                                : "see " + helpOf(command);
    fail(formatString("%.80s: unknown option, expected an option of %s; %s", name.c_str(), commandPath(command).c_str(),
                      hint.c_str()));
}

[[noreturn]] void failWord(const std::string& word, const CommandState& state)
{
    const CLI::App& command = *state.command;
    const std::string path = commandPath(command);
    if (state.positionals.empty() && !commandsOf(command).empty())
        failCommand(word, command);
    if (commandNamed(command, word) != nullptr)
        fail(formatString("%.80s: a command behind other words, expected it right behind %s; put it there, or write "
                          "./%.80s for a file of that name",
                          word.c_str(), path.c_str(), word.c_str()));
    if (!state.positionals.empty() && !nearestWord(state.positionals.front(), commandNames(command)).empty())
        failCommand(state.positionals.front(), command);
    const std::vector<const CLI::Option*> all = optionsOf(command);
    const auto most = std::count_if(all.begin(), all.end(), [](const CLI::Option* o) { return o->get_positional(); });
    fail(formatString("%.80s: one word too many, expected %s behind %s; see %s", word.c_str(),
                      most == 0 ? "options only" : formatString("%zu and options", size_t(most)).c_str(), path.c_str(),
                      helpOf(command).c_str()));
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
        const std::string help = helpOf(*state.command);
        if (state.awaited != nullptr && !state.awaited_may_end)
            failNoValue(*state.awaited);
        for (const CLI::Option* option : optionsOf(*state.command)) {
            const auto count = [&](const CLI::Option* other) {
                const auto found = state.given.find(other);
                return found == state.given.end() ? 0 : found->second;
            };
            const std::string name = optionName(*option);
            if (option->get_required() && count(option) == 0)
                fail(option->get_positional() && !listTaken().empty()
                         ? formatString("%s: not given, because %s took every word behind it, expected it before the "
                                        "options; put it right behind %s",
                                        option->get_name(true, false).c_str(), listTaken().c_str(),
                                        commandPath(*state.command).c_str())
                     : option->get_positional()
                         ? formatString("%s: not given, expected it behind %s; see %s",
                                        option->get_name(true, false).c_str(), commandPath(*state.command).c_str(),
                                        help.c_str())
                         : formatString("%s: not given, expected %s %s; see %s", name.c_str(), name.c_str(),
                                        placeholderOf(*option).c_str(), help.c_str()));
            if (count(option) == 0)
                continue;
            for (const CLI::Option* other : option->get_excludes())
                if (count(other) > 0)
                    fail(formatString("%s: together with %s, expected one of the two; leave one out", name.c_str(),
                                      optionName(*other).c_str()));
            for (const CLI::Option* other : option->get_needs())
                if (count(other) == 0)
                    fail(formatString("%s: has no effect without %s, expected both; pass %s too or leave %s out",
                                      name.c_str(), optionName(*other).c_str(), optionName(*other).c_str(),
                                      name.c_str()));
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

    // The list option that took more than one word; empty if there is none.
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
            fail(formatString("%s: stands before the command %s, expected behind it; put it there",
                              optionName(*m_state.given.begin()->first).c_str(), commandPath(sub).c_str()));
        std::vector<std::string> path = std::move(m_state.path);
        path.push_back(sub.get_name());
        m_state = {};
        m_state.command = &sub;
        m_state.path = std::move(path);
    }

    [[noreturn]] void failNoValue(const CLI::Option& option) const
    {
        const std::string name = optionName(option), placeholder = placeholderOf(option);
        fail(formatString("%s: no value given, expected %s %s; see %s", name.c_str(), name.c_str(), placeholder.c_str(),
                          helpOf(*m_state.command).c_str()));
    }

    void note(const CLI::Option& option)
    {
        const size_t count = ++m_state.given[&option];
        if (count == 2 && takesValue(option) && !takesSeveral(option) && !m_lenient)
            fail(formatString("%s: given twice, expected once; leave one out", optionName(option).c_str()));
        m_state.help_all |= &option == m_state.command->get_help_all_ptr();
        m_state.help |= m_state.help_all || &option == m_state.command->get_help_ptr();
        m_state.version |= &option == rootOf(*m_state.command).get_version_ptr();
        if (!takesValue(option))
            m_state.values.emplace_back(&option, "true");
    }

    void takeValue(const std::string& word, bool is_attached = false)
    {
        const CLI::Option& option = *m_state.awaited;
        // the name of another option is what somebody forgot the value before
        if (!m_lenient && !is_attached && looksLikeOption(word) &&
            m_state.command->get_option_no_throw(word) != nullptr)
            failNoValue(option);
        if (word.empty() && !m_lenient)
            fail(formatString("%s: an empty value, expected %s; correct it or leave %s out", optionName(option).c_str(),
                              placeholderOf(option).c_str(), optionName(option).c_str()));
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
            fail(formatString("%.80s: a value behind a flag, expected %s alone; leave the value out", word.c_str(),
                              optionName(*option).c_str()));
        m_state.awaited = option;
        takeValue(word.substr(equals + 1), true);
    }

    // -q, -vv, -qv, -oFILE
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
            fail(formatString("%s: an empty word, expected %s; see %s", option->get_name(true, false).c_str(),
                              placeholderOf(*option).c_str(), helpOf(*m_state.command).c_str()));
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
    root.parse(std::vector<std::string>(state.path.rbegin(), state.path.rend())); // runs the callbacks
}

CommandState followWords(const CLI::App& root, const std::vector<std::string>& words)
{
    Walker walker(root, true);
    for (const std::string& word : words)
        walker.take(word, words.size()); // nobody knows how many come
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
    fail(formatString("%.80s: no command of %s, expected %s; %s", word.c_str(), commandPath(command).c_str(),
                      commandsOf(command).empty() ? "none behind it" : listCommands(command).c_str(),
                      near.empty() ? ("see " + helpOf(command)).c_str() : ("did you mean " + near + "?").c_str()));
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
