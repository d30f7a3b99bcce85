// SPDX-License-Identifier: Apache-2.0
// Help as a terminal of a hundred columns shows it. CLI11 2.1 wraps no line and repeats a positional's name.
#pragma once

#include <memory>

namespace CLI {
class App;
class FormatterBase;
} // namespace CLI

namespace gsc {

// For a root, before its first sub-command, which take it over.
std::shared_ptr<CLI::FormatterBase> helpFormatter();

} // namespace gsc
