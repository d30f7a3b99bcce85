// SPDX-License-Identifier: Apache-2.0
// Words for messages that print a command, or that pass on the advice of one.
#pragma once

#include <string>

namespace gsc {

// Returns the word as a shell reads it: quoted if it is empty or has characters that a shell takes for more than text.
std::string shellWord(const std::string& word);

// Returns advice of `gsc convert`, a warning or a remedy, for another command that converts a model by itself: the
// advice says whose option it is, if it names one that only `gsc convert` has.
std::string convertAdvice(const std::string& text);

} // namespace gsc
