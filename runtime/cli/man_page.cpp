// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/man_page.h"

#include "runtime/cli/command_words.h"
#include "runtime/cli/version.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>

namespace gsc {

namespace {

// Escapes text for roff, so that no backslash, dash or dot in it acts as a command.
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

std::string synopsis(const CLI::App& command)
{
    std::string text = ".B " + escaped(commandPath(command)) + "\n";
    text += "[\\fIoptions\\fR]" + escaped(positionalsText(command)) + "\n";
    if (!commandsOf(command).empty())
        text += ".br\n.B " + escaped(commandPath(command)) + "\n\\fIcommand\\fR [\\fIoptions\\fR]\n";
    return text;
}

std::string entry(const std::string& name, const std::string& placeholder, const std::string& text)
{
    return ".TP\n\\fB" + escaped(name) + "\\fR" + (placeholder.empty() ? "" : " " + escaped(placeholder)) + "\n" +
           escaped(text) + "\n";
}

std::string optionEntry(const CLI::Option& option)
{
    std::string names = option.get_name(false, true);
    for (size_t at = 0; (at = names.find(',', at)) != std::string::npos; at += 2)
        names.insert(at + 1, " ");
    return entry(names, takesValue(option) ? placeholderOf(option) : "", option.get_description() + noteOf(option));
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
    page += ".nh\n.ad l\n"; // names of files and options stay whole
    page += ".SH NAME\n" + escaped(name) + " \\- " + escaped(short_text) + "\n";
    page += ".SH SYNOPSIS\n" + synopsis(command);
    page += ".SH DESCRIPTION\n" + escaped(description) + "\n";
    const auto words = command.get_options([](const CLI::Option* option) { return option->get_positional(); });
    page += words.empty() ? "" : ".SH WORDS\n";
    for (const CLI::Option* word : words)
        page += entry(word->get_name(true, false), "", word->get_description());
    for (const OptionGroup& group : groupsOf(command)) {
        page += ".SH " + upperCase(escaped(group.name)) + "\n";
        for (const CLI::Option* option : group.options)
            page += optionEntry(*option);
    }
    if (const auto subs = commandsOf(command); !subs.empty()) {
        page += ".SH COMMANDS\n";
        for (const CLI::App* sub : subs)
            page += entry(sub->get_name(), "", sub->get_description());
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
