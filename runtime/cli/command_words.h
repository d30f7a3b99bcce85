// SPDX-License-Identifier: Apache-2.0
// The words of a command line against the tree of commands and options, before CLI11 parses them. CLI11's own messages
// neither say what was expected nor guess what was meant, and differ between its versions.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace gsc {

// Where a command line stands after some of its words.
struct CommandState {
    const CLI::App* command = nullptr;    // the innermost so far
    const CLI::Option* awaited = nullptr; // the option whose value comes next; null = none
    bool awaited_may_end = false;         // it has a value already and takes more
    bool only_positionals = false;        // "--" was there
    std::vector<std::string> positionals; // words without an option
    std::map<const CLI::Option*, size_t> given;
    bool help = false, version = false;
    std::vector<std::string> path, options; // names of commands, and options as CLI11 takes them in one way only
};

// `words` without the program's name. Throws Error(Usage) for the first word that does not fit, and for what is missing
// at the end; after --help or --version nothing is missing.
CommandState checkWords(const CLI::App& root, const std::vector<std::string>& words);

// The words that were checked, in the order in which CLI11 reads them as checkWords() did: commands, positionals, options,
// a list one value at a time.
std::vector<std::string> plainWords(const CommandState& state);

// The state after `words`, as far as they fit: for completion.
CommandState followWords(const CLI::App& root, const std::vector<std::string>& words);

// The commands right below one, in the order in which they were declared, and its options.
std::vector<const CLI::App*> commandsOf(const CLI::App& command);
std::vector<const CLI::Option*> optionsOf(const CLI::App& command);
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
// Does it take a value?
bool takesValue(const CLI::Option& option);
bool takesSeveral(const CLI::Option& option);
// The positional that takes the next word without an option; null if none does.
const CLI::Option* nextPositional(const CommandState& state);
// The part of the option's text that names what it takes, "FILE.gsc" of "FILE.gsc (default: none)".
std::string placeholderOf(const CLI::Option& option);

} // namespace gsc
