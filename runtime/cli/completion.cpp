// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/completion.h"

#include "runtime/cli/command_words.h"

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
        lines += "\t" + summaryOf(help);
    lines += "\n";
}

bool isPlaceholder(const std::string& part)
{
    return std::isupper(static_cast<unsigned char>(part[0])) != 0;
}

// Adds a line for each value of `option` that starts with `begun`; `before` is put in front of each, such as
// "--format=".
void addValues(std::string& lines, const CLI::Option& option, const std::string& begun, const std::string& before)
{
    const std::string text = placeholderOf(option);
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find('|', at), text.size());
        std::string part = text.substr(at, end - at);
        at = end + 1;
        if (part.size() > 3 && part.ends_with("..."))
            part.resize(part.size() - 3);
        if (part.empty())
            continue;
        const size_t dot = part.find('.');
        const std::string kind = part.substr(0, dot);
        if (!isPlaceholder(part)) {
            if (part.starts_with(begun))
                addLine(lines, before + part, "");
        } else if (kind == "DIR" || kind == "MODEL")
            lines += ":folders\n";
        else if (kind == "FILE" || kind == "CHECKPOINT" || kind == "PATTERN")
            lines += ":files" + (dot == std::string::npos ? "" : " " + part.substr(dot)) + "\n";
    }
}

// Adds the options of a command that start with `begun`, without those that are given already or that a given one
// excludes.
void addOptions(std::string& lines, const CLI::App& command, const std::string& begun, const CommandState& state)
{
    const auto given = [&](const CLI::Option* option) { return state.given.count(option) > 0; };
    for (const CLI::Option* option : optionsOf(command)) {
        const auto& rivals = option->get_excludes();
        if ((given(option) && !takesSeveral(*option)) || std::any_of(rivals.begin(), rivals.end(), given))
            continue;
        for (const std::string& name : option->get_lnames())
            if (("--" + name).starts_with(begun))
                addLine(lines, "--" + name, option->get_description());
    }
}

void addCommands(std::string& lines, const CLI::App& command, const std::string& begun)
{
    for (const CLI::App* sub : commandsOf(command))
        if (sub->get_name().starts_with(begun))
            addLine(lines, sub->get_name(), sub->get_description());
}

constexpr const char* kBash = R"script(# bash completion of PROGRAM, printed by `PROGRAM completion bash`

# The words of a line without their quotes, the last one empty or begun. `head` is what bash leaves of the last one:
# it replaces what stands behind the last = or : alone.
_FUNCTION_split() {
    local text=$1 word='' begun='' quote='' char i
    words=() head=''
    for ((i = 0; i < ${#text}; i++)); do
        char=${text:i:1}
        case $quote$char in
        ' ' | $'\t' | $'\n')
            [[ $begun ]] && words+=("$word")
            word='' begun='' head=''
            continue
            ;;
        '\' | '"\')
            ((i++))
            word+=${text:i:1}
            ;;
        '"' | "'") quote=$char head=$word ;;
        '""' | "''") quote='' ;;
        *)
            word+=$char
            [[ ! $quote && $COMP_WORDBREAKS == *"$char"* ]] && head=$word
            ;;
        esac
        begun=1
    done
    words+=("$word")
}

_FUNCTION_complete() {
    local words head line ending path real option='' value
    _FUNCTION_split "${COMP_LINE:0:COMP_POINT}"
    value=${words[-1]}
    [[ $value == --*=* ]] && option=${value%%=*}= value=${value#*=}
    real=$value
    [[ $value == '~/'* ]] && real=$HOME/${value#'~/'}
    [[ ${words[0]} == '~/'* ]] && words[0]=$HOME/${words[0]#'~/'}
    COMPREPLY=()
    while IFS= read -r line; do
        case $line in
        :folders | :files*)
            compopt -o filenames 2>/dev/null
            ending=${line#:files}
            for path in "$real"*; do
                if [[ -d $path || (-e $path && $line == :files* && $path == *"${ending# }") ]]; then
                    path=$option$value${path#"$real"}
                    COMPREPLY+=("${path#"$head"}")
                fi
            done
            ;;
        *)
            line=${line%%$'\t'*}
            COMPREPLY+=("${line#"$head"}")
            ;;
        esac
    done < <("${words[0]}" __complete "${words[@]:1}" 2>/dev/null)
}
complete -F _FUNCTION_complete PROGRAM
)script";

constexpr const char* kZsh = R"script(#compdef PROGRAM
# zsh completion of PROGRAM, printed by `PROGRAM completion zsh`
_PROGRAM() {
    local program=${~${(Q)words[1]}} line word before='' ret=1
    local -a lines options found
    lines=("${(@f)$("$program" __complete "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}")
    compset -P 1 '--*=' && before='*='
    for line in $lines; do
        case $line in
        :folders) _path_files -/ && ret=0 ;;
        :files*)
            _path_files -g "*${line##:files( |)}(-.)" && ret=0
            _path_files -/ && ret=0
            ;;
        *)
            word=${line%%$'\t'*}
            word=${${word#$~before}//:/\\:}
            [[ $line == *$'\t'* ]] && word+=:${line#*$'\t'}
            if [[ $word == -* ]]; then
                options+=("$word")
            else
                found+=("$word")
            fi
            ;;
        esac
    done
    (( ${#options} )) && _describe -o 'option' options && ret=0
    (( ${#found} )) && _describe 'word' found && ret=0
    return ret
}
if [[ ${funcstack[1]} == _PROGRAM ]]; then # called by zsh, which found this file in fpath
    _PROGRAM "$@"
else
    compdef _PROGRAM PROGRAM
fi
)script";

constexpr const char* kFish = R"script(# fish completion of PROGRAM, printed by `PROGRAM completion fish`
function _FUNCTION_complete
    set -l words (commandline -opc)
    set -l raw (commandline -ct)
    # the quote of a word that is begun has no end
    set -l word (string unescape -- "$raw"; or string unescape -- "$raw\""; or string unescape -- "$raw'")
    set -l option (string match -r -- '^--[^=]*=' $word; or echo)
    set -l value (string sub -s (math (string length -- "$option") + 1) -- $word)
    set -l folder (string replace -r '[^/]*$' '' -- $value)
    set -l real (string replace -r '^~/' "$HOME/" -- $folder)
    set -l dot (string match -r '^\.' -- (string replace -r '.*/' '' -- $value); or echo)
    set -l start (math (string length -- "$real") + 1)
    set -l program (string replace -r '^~/' "$HOME/" -- $words[1])
    for line in ($program __complete $words[2..-1] "$word" 2>/dev/null)
        switch $line
            case ':folders' ':files*'
                set -l ending (string replace -r '^:\w+ ?' '' -- $line)
                for path in $real$dot*
                    set -l name $option$folder(string sub -s $start -- $path)
                    if test -d $path
                        printf '%s/\n' $name
                    else if test $line != ':folders'; and string match -q -- "*$ending" $path
                        printf '%s\n' $name
                    end
                end
            case '*'
                printf '%s\n' $line
        end
    end
end
complete -c PROGRAM -f -a '(_FUNCTION_complete)'
)script";

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
    if (!state.only_positionals && last.starts_with("--") && last.find('=') != std::string::npos) {
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
        addCommands(lines, command, last);
    if (const CLI::Option* option = nextPositional(state)) {
        if (placeholderOf(*option) == "COMMAND") { // for help and man: commands below the words so far
            const CLI::App* below = &root;
            for (const std::string& word : state.positionals)
                below = below != nullptr ? commandNamed(*below, word) : nullptr;
            if (below != nullptr)
                addCommands(lines, *below, last);
            if (below != nullptr && command.get_name() == "help")
                for (const OptionGroup& group : groupsOf(*below))
                    if (topicOf(group).starts_with(last) &&
                        std::ranges::any_of(group.options, [](const auto* each) { return isRare(*each); }))
                        addLine(lines, topicOf(group), group.name);
        } else
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
