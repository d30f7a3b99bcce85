// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/help_page.h"

#include "runtime/cli/command_words.h"

#include <CLI/CLI.hpp>

#include <algorithm>

namespace gsc {

namespace {

constexpr size_t kNameColumns = 28, kColumns = 80;
constexpr size_t kManyOptions = 20; // a page with more options shows short texts

// Appends the words of `text` to `start`, in lines of at most kColumns that are indented by `indent` columns.
std::string wrapped(const std::string& start, const std::string& text, size_t indent)
{
    std::string out = start;
    size_t column = start.size();
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find(' ', at), text.size());
        if (column > 0 && column + 1 + end - at > kColumns) {
            out += "\n";
            column = 0;
        }
        const std::string gap(column < indent ? indent - column : size_t(column > indent), ' ');
        out += gap + text.substr(at, end - at);
        column += gap.size() + end - at;
        at = end + 1;
    }
    return out + "\n";
}

std::string entry(const std::string& name, const std::string& text)
{
    std::string start = "  " + name;
    for (size_t begin = 0; start.size() - begin > kColumns;) { // a long list of values is broken at |
        begin = start.rfind('|', begin + kColumns - 1) + 1;
        start.insert(begin, "\n      ");
    }
    return start.size() + 2 > kNameColumns ? start + "\n" + wrapped("", text, kNameColumns)
                                           : wrapped(start, text, kNameColumns);
}

std::string optionEntry(const CLI::Option& option, bool brief)
{
    const std::string help = option.get_description();
    return entry(option.get_name(false, true) + (takesValue(option) ? " " + placeholderOf(option) : ""),
                 (brief ? summaryOf(help) : help) + noteOf(option));
}

// Makes the text of a group. `all`: rare options are included. `brief`: only the first part of each option's text.
std::string groupText(const OptionGroup& group, const CLI::App& command, bool all, bool brief)
{
    std::string lines, more;
    for (const CLI::Option* option : group.options)
        if (all || !isRare(*option))
            lines += optionEntry(*option, brief);
        else if (more.empty()) {
            const std::string path = commandPath(command);
            const size_t root = std::min(path.find(' '), path.size());
            more = " (all: " + path.substr(0, root) + " help" + path.substr(root) + " " + topicOf(group) + ")";
        }
    return lines.empty() ? "" : (brief ? "" : "\n") + group.name + more + ":\n" + lines;
}

} // namespace

std::string helpPage(const CLI::App& command, bool all)
{
    const std::vector<const CLI::Option*> options = optionsOf(command);
    const bool brief = !all && options.size() > kManyOptions;
    const bool has_commands = !commandsOf(command).empty();
    std::string page = wrapped("", command.get_description(), 0) + "Usage: " + commandPath(command) + " [OPTIONS]" +
                       positionalsText(command) + (has_commands ? " [COMMAND]" : "") + "\n";
    std::string words, commands;
    for (const CLI::Option* option : options)
        if (option->get_positional())
            words += entry(option->get_name(true, false), option->get_description() + noteOf(*option));
    for (const CLI::App* sub : commandsOf(command))
        commands += entry(sub->get_name(), sub->get_description());
    page += words.empty() ? "" : "\nArguments:\n" + words;
    page += brief ? "\n" : "";
    for (const OptionGroup& group : groupsOf(command))
        page += groupText(group, command, all, brief);
    page += commands.empty() ? "" : "\nCommands:\n" + commands;
    const std::string& footer = command.get_footer();
    return page + (footer.empty() ? "" : "\n" + footer.substr(0, all ? footer.npos : footer.find("\n\nmore")) + "\n");
}

std::string topicPage(const CLI::App& command, const std::string& topic)
{
    std::string page;
    for (const OptionGroup& group : groupsOf(command))
        if (topicOf(group) == topic)
            page += groupText(group, command, true, false);
    return page.empty() ? page : page.substr(1);
}

} // namespace gsc
