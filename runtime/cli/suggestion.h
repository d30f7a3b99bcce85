// SPDX-License-Identifier: Apache-2.0
// Suggestion of a known word for a mistyped one, and lists of words in messages.
#pragma once

#include <string>
#include <vector>

namespace gsc {

// The known word with the fewest insertions, deletions, replacements and swaps of neighbours to it (optimal string
// alignment); empty if it takes more than a third of the letters. A word that a known one starts with counts as near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

// "a", "a or b", "a, b or c".
std::string listWords(const std::vector<std::string>& words);

} // namespace gsc
