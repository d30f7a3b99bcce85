// SPDX-License-Identifier: Apache-2.0
// Suggests a known word for a mistyped one, and writes lists of words for messages.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace gsc {

// Returns the known word that needs the fewest insertions, deletions, replacements and swaps of neighbours (optimal
// string alignment); empty if they are more than a third of the letters. A word with which a known one starts counts
// as near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

// Returns the `count` known words that need the fewest edits, whatever the case of letters; of equals those that begin
// as `word` does come first. Fewer if there are no more.
std::vector<std::string> nearestWords(const std::string& word, const std::vector<std::string>& known, size_t count);

// Writes a list as "a", "a or b" or "a, b or c".
std::string listWords(const std::vector<std::string>& words);

} // namespace gsc
