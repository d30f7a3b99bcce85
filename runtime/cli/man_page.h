// SPDX-License-Identifier: Apache-2.0
// Makes manual pages from the declared commands.
#pragma once

#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// Returns the manual page of a command, in the macros of man(7).
std::string manPage(const CLI::App& command);

} // namespace gsc
