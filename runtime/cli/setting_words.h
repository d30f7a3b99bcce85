// SPDX-License-Identifier: Apache-2.0
// Words of the programs for settings that the libraries' errors speak of.
#pragma once

#include <gsc/error.h>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// The error with the options and commands of its settings behind its remedy: those options that `command` has, or all
// where it is null.
Error withOptions(const Error& error, const CLI::App* command);

} // namespace gsc
