// SPDX-License-Identifier: Apache-2.0
// Manual pages from the tree of commands.
#pragma once

#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// The page of a command in man(7)'s macros.
std::string manPage(const CLI::App& command);

} // namespace gsc
