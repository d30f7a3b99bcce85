// SPDX-License-Identifier: Apache-2.0
// Help as a terminal of eighty columns shows it.
#pragma once

#include <string>

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

// The options that most need, in short where they are many, and the notes up to
// the paragraph "more"; with `all` everything.
std::string helpPage(const CLI::App& command, bool all);
// Every option of one of the command's groups; empty if it has none of that topic (topicOf()).
std::string topicPage(const CLI::App& command, const std::string& topic);

} // namespace gsc
