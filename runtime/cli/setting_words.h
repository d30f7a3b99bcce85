// SPDX-License-Identifier: Apache-2.0
// Translates the settings that errors of the libraries name into options of the programs.
#pragma once

#include <gsc/error.h>

#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// Returns the error with options and commands for its settings added to the remedy: those options that `command` has,
// or all if it is null.
Error withOptions(const Error& error, const CLI::App* command);

// Text of an error that is only a warning, with the words of all its settings.
std::string warningText(const Error& error);

} // namespace gsc
