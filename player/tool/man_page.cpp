// SPDX-License-Identifier: Apache-2.0
#include "player/tool/man_page.h"

#include "player/tool/command_words.h"
#include "player/tool/version.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>

namespace gsc {

namespace {

// Text as roff prints it: no backslash, dash or dot of it is a command.
std::string escaped(const std::string& text)
{
    std::string out;
    bool line_start = true;
    for (const char c : text) {
        if (line_start && (c == '.' || c == '\''))
            out += "\\&";
        line_start = c == '\n';
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else
            out += c;
    }
    return out;
}

std::string pageName(const CLI::App& command)
{
    std::string name = commandPath(command);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string upperCase(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return text;
}

std::vector<const CLI::App*> commandsOf(const CLI::App& command)
{
    return command.get_subcommands([](const CLI::App*) { return true; });
}

std::string synopsis(const CLI::App& command)
{
    std::string text = ".B " + escaped(commandPath(command)) + "\n";
    std::string words;
    for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
        const std::string name = option->get_name(true, false) + (takesSeveral(*option) ? "..." : "");
        words += (option->get_required() ? " " + name : " [" + name + "]");
    }
    text += "[\\fIoptions\\fR]" + escaped(words) + "\n";
    if (!commandsOf(command).empty())
        text += ".br\n.B " + escaped(commandPath(command)) + "\n\\fIcommand\\fR [\\fIoptions\\fR]\n";
    return text;
}

std::string optionEntry(const CLI::Option& option)
{
    std::string names = option.get_positional() ? option.get_name(true, false) : option.get_name(false, true);
    for (size_t at = 0; (at = names.find(',', at)) != std::string::npos; at += 2)
        names.insert(at + 1, " ");
    const std::string& text = option.get_option_text();
    return ".TP\n\\fB" + escaped(names) + "\\fR" +
           (takesValue(option) && !option.get_positional() ? " " + escaped(text) : "") + "\n" +
           escaped(option.get_description()) + "\n";
}

} // namespace

std::string manPage(const CLI::App& command)
{
    const std::string name = pageName(command);
    std::string description = command.get_description();
    std::string short_text = description.substr(0, description.find(". "));
    if (!short_text.empty() && short_text.back() == '.')
        short_text.pop_back();
    std::string page =
        ".TH \"" + escaped(upperCase(name)) + "\" 1 \"\" \"gsc " + toolVersion() + "\" \"User Commands\"\n";
    page += ".SH NAME\n" + escaped(name) + " \\- " + escaped(short_text) + "\n";
    page += ".SH SYNOPSIS\n" + synopsis(command);
    page += ".SH DESCRIPTION\n" + escaped(description) + "\n";
    for (const std::string& group : command.get_groups()) {
        const auto options = command.get_options(
            [&](const CLI::Option* option) { return option->get_group() == group && !group.empty(); });
        if (options.empty())
            continue;
        page += ".SH " + upperCase(escaped(group)) + "\n";
        for (const CLI::Option* option : options)
            page += optionEntry(*option);
    }
    if (const auto subs = commandsOf(command); !subs.empty()) {
        page += ".SH COMMANDS\n";
        for (const CLI::App* sub : subs)
            page += ".TP\n\\fB" + escaped(sub->get_name()) + "\\fR\n" + escaped(sub->get_description()) + "\n";
    }
    if (!command.get_footer().empty())
        page += ".SH NOTES\n.nf\n" + escaped(command.get_footer()) + "\n.fi\n";
    std::string also;
    if (command.get_parent() != nullptr)
        also = "\\fB" + escaped(pageName(*command.get_parent())) + "\\fR(1)";
    for (const CLI::App* sub : commandsOf(command))
        if (const std::string sub_name = sub->get_name(); sub_name != "help" && sub_name != "man")
            also += (also.empty() ? "" : ", ") + ("\\fB" + escaped(pageName(*sub)) + "\\fR(1)");
    return page + (also.empty() ? "" : ".SH SEE ALSO\n" + also + "\n");
}

} // namespace gsc
