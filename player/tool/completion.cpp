// SPDX-License-Identifier: Apache-2.0
#include "player/tool/completion.h"

#include "player/tool/command_words.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <utility>

namespace gsc {

namespace {

void addLine(std::string& lines, const std::string& word, const std::string& help)
{
    lines += word;
    if (!help.empty())
        lines += "\t" + help.substr(0, help.find_first_of(":;\n"));
    lines += "\n";
}

bool starts(const std::string& word, const std::string& begun)
{
    return word.compare(0, begun.size(), begun) == 0;
}

bool isPlaceholder(const std::string& part)
{
    return std::isupper(static_cast<unsigned char>(part[0])) != 0;
}

// What `option` takes. `before` is put before each word: "--format=".
void addValues(std::string& lines, const CLI::Option& option, const std::string& begun, const std::string& before)
{
    const std::string text = placeholderOf(option);
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find('|', at), text.size());
        std::string part = text.substr(at, end - at);
        at = end + 1;
        if (part.size() > 3 && part.compare(part.size() - 3, 3, "...") == 0)
            part.resize(part.size() - 3);
        if (part.empty())
            continue;
        const size_t dot = part.find('.');
        const std::string kind = part.substr(0, dot);
        if (!isPlaceholder(part)) {
            if (starts(part, begun))
                addLine(lines, before + part, "");
        } else if (kind == "DIR" || kind == "MODEL")
            lines += ":folders\n";
        else if (kind == "FILE" || kind == "CHECKPOINT" || kind == "PATTERN")
            lines += ":files" + (dot == std::string::npos ? "" : " " + part.substr(dot)) + "\n";
    }
}

void addOptions(std::string& lines, const CLI::App& command, const std::string& begun, const CommandState& state)
{
    for (const CLI::Option* option : command.get_options([](const CLI::Option*) { return true; })) {
        const auto given = state.given.find(option);
        if (given != state.given.end() && takesValue(*option) && !takesSeveral(*option))
            continue;
        for (const std::string& name : option->get_lnames())
            if (starts("--" + name, begun))
                addLine(lines, "--" + name, option->get_description());
    }
}

constexpr const char* kBash = R"(# bash completion of PROGRAM, printed by `PROGRAM completion bash`
_FUNCTION_complete() {
    local IFS=$'\n' line cur words=() word i
    # bash cuts --format=json into three words
    for ((i = 1; i <= COMP_CWORD; i++)); do
        word=${COMP_WORDS[i]}
        if [[ $word == = && ${#words[@]} -gt 0 ]]; then
            words[-1]+==
        elif [[ ${#words[@]} -gt 0 && ${words[-1]} == --*= ]]; then
            words[-1]+=$word
        else
            words+=("$word")
        fi
    done
    cur=${COMP_WORDS[COMP_CWORD]}
    [[ $cur == = ]] && cur=
    COMPREPLY=()
    for line in $("${COMP_WORDS[0]}" __complete "${words[@]}" 2>/dev/null); do
        case $line in
        :folders)
            compopt -o filenames 2>/dev/null
            COMPREPLY+=($(compgen -d -- "$cur"))
            ;;
        :files)
            compopt -o filenames 2>/dev/null
            COMPREPLY+=($(compgen -f -- "$cur"))
            ;;
        ":files "*)
            compopt -o filenames 2>/dev/null
            COMPREPLY+=($(compgen -d -- "$cur"; compgen -f -X "!*${line#:files }" -- "$cur"))
            ;;
        *)
            word=${line%%$'\t'*}
            [[ ${words[-1]} == --*=* ]] && word=${word#*=}
            COMPREPLY+=("$word")
            ;;
        esac
    done
}
complete -F _FUNCTION_complete PROGRAM
)";

constexpr const char* kZsh = R"(#compdef PROGRAM
# zsh completion of PROGRAM, printed by `PROGRAM completion zsh`
_FUNCTION() {
    local line word
    local -a found
    for line in "${(@f)$(${words[1]} __complete "${(@)words[2,CURRENT]}" 2>/dev/null)}"; do
        case $line in
        '') ;;
        :folders) _path_files -/ ;;
        :files) _files ;;
        ":files "*) _files -g "*${line#:files }" ;;
        *)
            word=${line%%$'\t'*}
            if [[ $line == *$'\t'* ]]; then
                found+=("${word//:/\\:}:${line#*$'\t'}")
            else
                found+=("${word//:/\\:}")
            fi
            ;;
        esac
    done
    (( ${#found} )) && _describe 'PROGRAM' found
}
if [[ ${funcstack[1]} == _FUNCTION ]]; then
    _FUNCTION "$@"
else
    compdef _FUNCTION PROGRAM
fi
)";

constexpr const char* kFish = R"(# fish completion of PROGRAM, printed by `PROGRAM completion fish`
function _FUNCTION_complete
    set -l words (commandline -opc) (commandline -ct)
    set -l last $words[-1]
    string match -q -- '--*=*' $last; and set last (string replace -r '^[^=]*=' '' -- $last)
    for line in ($words[1] __complete $words[2..-1] 2>/dev/null)
        switch $line
            case ':folders'
                __fish_complete_directories $last
            case ':files'
                __fish_complete_path $last
            case ':files *'
                set -l ending (string replace ':files ' '' -- $line)
                for path in (__fish_complete_path $last)
                    string match -q -r -- '/$|'(string escape --style=regex -- $ending)'($|\t)' $path; and echo $path
                end
            case '*'
                echo $line
        end
    end
end
complete -c PROGRAM -f -a '(_FUNCTION_complete)'
)";

} // namespace

std::string completions(const CLI::App& root, const std::vector<std::string>& words)
{
    std::string lines;
    const std::string last = words.empty() ? "" : words.back();
    const CommandState state = followWords(root, {words.begin(), words.empty() ? words.end() : words.end() - 1});
    const CLI::App& command = *state.command;
    if (state.awaited != nullptr) {
        addValues(lines, *state.awaited, last, "");
        if (!state.awaited_may_end)
            return lines;
    }
    if (!state.only_positionals && last.rfind("--", 0) == 0 && last.find('=') != std::string::npos) {
        const std::string name = last.substr(0, last.find('='));
        if (const CLI::Option* option = command.get_option_no_throw(name); option != nullptr && takesValue(*option))
            addValues(lines, *option, last.substr(name.size() + 1), name + "=");
        return lines;
    }
    if (!state.only_positionals && !last.empty() && last[0] == '-') {
        addOptions(lines, command, last, state);
        return lines;
    }
    if (state.positionals.empty() && state.given.empty())
        for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
            if (starts(sub->get_name(), last))
                addLine(lines, sub->get_name(), sub->get_description());
    if (const CLI::Option* option = nextPositional(state)) {
        if (placeholderOf(*option) == "COMMAND") { // of help and man
            std::vector<std::string> path(words.begin() + 1, words.end());
            return completions(root, path);
        }
        addValues(lines, *option, last, "");
    }
    return lines;
}

std::string completionScript(Shell shell, const std::string& program)
{
    std::string text = shell == Shell::Bash ? kBash : shell == Shell::Zsh ? kZsh : kFish;
    std::string function = program;
    std::replace(function.begin(), function.end(), '-', '_');
    for (const auto& [word, value] : {std::pair<std::string, std::string>{"PROGRAM", program}, {"FUNCTION", function}})
        for (size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += value.size())
            text.replace(at, word.size(), value);
    return text;
}

} // namespace gsc
