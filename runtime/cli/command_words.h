// SPDX-License-Identifier: Apache-2.0
// The grammar of the command line: which word is a command, an option, a value or a positional. CLI11 holds what was
// declared and runs its callbacks; its messages neither say what was expected nor guess what was meant.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace gsc {

// Position in a command line after some of its words.
struct CommandState {
    const CLI::App* command = nullptr;    // the innermost so far
    const CLI::Option* awaited = nullptr; // the option whose value comes next; null = none
    bool awaited_may_end = false;         // the awaited option has a value already and may take more
    bool only_positionals = false;        // "--" was there
    std::vector<std::string> positionals; // words without an option
    std::map<const CLI::Option*, size_t> given;
    bool help = false, help_all = false, version = false;
    std::vector<std::string> path; // names of commands
    // values given to options and positionals; a flag's is "true"
    std::vector<std::pair<const CLI::Option*, std::string>> values;
};

// `words`: the command line without the program's name. Throws Error(Usage) for the first word that does not fit, or
// for a missing word at the end; after --help or --version nothing is missing.
CommandState checkWords(const CLI::App& root, const std::vector<std::string>& words);

// Gives the values to the options that were declared, and runs the callbacks of these and of the commands.
void giveWords(CLI::App& root, const CommandState& state);

// The state after `words`, as far as they fit: for completion.
CommandState followWords(const CLI::App& root, const std::vector<std::string>& words);

// The commands right below one, in the order in which they were declared, and its options.
std::vector<const CLI::App*> commandsOf(const CLI::App& command);
std::vector<const CLI::Option*> optionsOf(const CLI::App& command);
// Options of a command, without positionals, by their heading.
struct OptionGroup {
    std::string name;
    std::vector<const CLI::Option*> options;
};
std::vector<OptionGroup> groupsOf(const CLI::App& command);
// The word by which `help` shows a group alone: the first of its name, "reuse".
std::string topicOf(const OptionGroup& group);
// The one of a name; null if there is none.
const CLI::App* commandNamed(const CLI::App& command, const std::string& name);
// Their names, "convert, info or sample".
std::string listCommands(const CLI::App& command);
// Throws Error(Usage) for a word that is no command below `command`.
[[noreturn]] void failCommand(const std::string& word, const CLI::App& command);
// "gsc sample paths": the command with all above it.
std::string commandPath(const CLI::App& command);
// The longest name of an option, "--size", or of a positional, "FILE".
std::string optionName(const CLI::Option& option);
// Left out of --help; --help-all and the page of its group show it.
bool isRare(const CLI::Option& option);
inline constexpr const char* kRare = " (rare)"; // behind the name of its group
// " [FILE] WORD...": the positionals as a usage shows them.
std::string positionalsText(const CLI::App& command);
// The part of a help text that says it in short.
std::string summaryOf(const std::string& help);
// True if the option takes a value.
bool takesValue(const CLI::Option& option);
bool takesSeveral(const CLI::Option& option);
// The positional that takes the next word without an option; null if none does.
const CLI::Option* nextPositional(const CommandState& state);
// The part of the option's placeholder that names its value: "FILE.gsc" of "FILE.gsc (default: none)".
std::string placeholderOf(const CLI::Option& option);
// The rest of it, " (default: none)".
std::string noteOf(const CLI::Option& option);

} // namespace gsc
