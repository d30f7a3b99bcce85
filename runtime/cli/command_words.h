// SPDX-License-Identifier: Apache-2.0
// The grammar of the command line: decides which word is a command, an option, a value or a positional. CLI11 holds
// the declared options and runs their callbacks, but its messages do not say what was expected or what was probably
// meant.
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

// State of reading a command line after some of the words.
struct CommandState {
    const CLI::App* command = nullptr;    // the innermost command read so far
    const CLI::Option* awaited = nullptr; // option whose value must come next; null = none
    bool awaited_may_end = false;         // `awaited` has a value already and may take more
    bool only_positionals = false;        // "--" was read, so no further word is an option
    std::vector<std::string> positionals; // words that belong to no option
    std::map<const CLI::Option*, size_t> given;
    bool help = false, help_all = false, version = false;
    std::vector<std::string> path; // names of the commands, the outermost first
    // Values given to options and positionals; a flag has the value "true".
    std::vector<std::pair<const CLI::Option*, std::string>> values;
};

// Checks the words of a command line without the program's name. Throws Error(Usage) for the first word that does not
// fit, or if a word is missing at the end; after --help or --version nothing counts as missing.
CommandState checkWords(const CLI::App& root, const std::vector<std::string>& words);

// Gives the values to the declared options, and runs the callbacks of the options and the commands.
void giveWords(CLI::App& root, const CommandState& state);

// For completion: returns the state after the first words that fit.
CommandState followWords(const CLI::App& root, const std::vector<std::string>& words);

// Returns the commands right below `command`, in the order in which they were declared.
std::vector<const CLI::App*> commandsOf(const CLI::App& command);
std::vector<const CLI::Option*> optionsOf(const CLI::App& command);
// Options of a command under one heading of the help, without positionals.
struct OptionGroup {
    std::string name;
    std::vector<const CLI::Option*> options;
};
std::vector<OptionGroup> groupsOf(const CLI::App& command);
// Returns the word that `help` takes for a group: the first word of the heading, such as "reuse".
std::string topicOf(const OptionGroup& group);
// Returns the command of this name below `command`; null if there is none.
const CLI::App* commandNamed(const CLI::App& command, const std::string& name);
// Returns the names of the commands below `command` as a text, "convert, info or sample".
std::string listCommands(const CLI::App& command);
// Throws Error(Usage) for a word that is no command below `command`.
[[noreturn]] void failCommand(const std::string& word, const CLI::App& command);
// Returns the names of the command and of all above it, "gsc sample paths".
std::string commandPath(const CLI::App& command);
// Returns the longest name of an option, "--size", or the name of a positional, "FILE".
std::string optionName(const CLI::Option& option);
// Returns true if --help leaves the option out; --help-all and the page of the option's group show it.
bool isRare(const CLI::Option& option);
inline constexpr const char* kRare = " (rare)"; // behind the name of its group
// Returns the positionals as a usage line shows them, " [FILE] WORD...".
std::string positionalsText(const CLI::App& command);
// Returns the first part of a help text, which is a short form of the whole.
std::string summaryOf(const std::string& help);
// Returns true if the option takes a value.
bool takesValue(const CLI::Option& option);
bool takesSeveral(const CLI::Option& option);
// Returns the positional that the next word belongs to if it is no option; null if none is left.
const CLI::Option* nextPositional(const CommandState& state);
// Returns the part of the option's placeholder that describes the value: "FILE.gsc" of "FILE.gsc (default: none)".
std::string placeholderOf(const CLI::Option& option);
// Returns the rest of the option's placeholder, " (default: none)".
std::string noteOf(const CLI::Option& option);

} // namespace gsc
