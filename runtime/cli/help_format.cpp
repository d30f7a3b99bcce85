// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/help_format.h"

#include <CLI/CLI.hpp>

namespace gsc {

namespace {

constexpr size_t kNameColumns = 30, kColumns = 100;

// "  name" and, from column kNameColumns on, the text in lines of words.
std::string entry(const std::string& name, const std::string& text)
{
    std::string out = "  " + name;
    size_t column = out.size();
    if (column + 2 > kNameColumns) {
        out += "\n";
        column = 0;
    }
    out += std::string(kNameColumns - column, ' ');
    column = kNameColumns;
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find(' ', at), text.size());
        if (column > kNameColumns && column + 1 + end - at > kColumns) {
            out += "\n" + std::string(kNameColumns, ' ');
            column = kNameColumns;
        } else if (column > kNameColumns) {
            out += " ";
            ++column;
        }
        out += text.substr(at, end - at);
        column += end - at;
        at = end + 1;
    }
    return out + "\n";
}

class HelpFormatter : public CLI::Formatter {
public:
    std::string make_option(const CLI::Option* option, bool is_positional) const override
    {
        const std::string& text = option->get_option_text();
        const std::string note =
            is_positional && text.find(" (") != std::string::npos ? text.substr(text.find(" (")) : "";
        const bool has_value = !is_positional && option->get_items_expected_max() > 0;
        return entry(make_option_name(option, is_positional) + (has_value ? " " + text : note),
                     make_option_desc(option));
    }
    std::string make_subcommand(const CLI::App* sub) const override
    {
        return entry(sub->get_name(), sub->get_description());
    }
};

} // namespace

std::shared_ptr<CLI::FormatterBase> helpFormatter()
{
    auto formatter = std::make_shared<HelpFormatter>();
    formatter->label("Positionals", "Words");
    formatter->label("SUBCOMMAND", "COMMAND");
    formatter->label("SUBCOMMANDS", "COMMANDS");
    formatter->label("Subcommands", "Commands");
    return formatter;
}

} // namespace gsc
