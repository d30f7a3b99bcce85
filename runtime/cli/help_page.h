// SPDX-License-Identifier: Apache-2.0
// Makes help pages for a terminal of eighty columns.
#pragma once

#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// Returns the help of a command. By default it holds all but rare options, with short texts if they are many, and the
// notes up to the paragraph "more"; with `all` it holds everything.
std::string helpPage(const CLI::App& command, bool all);
// Returns the help of one group of options, chosen by topicOf(); empty if the command has no such group.
std::string topicPage(const CLI::App& command, const std::string& topic);

} // namespace gsc
