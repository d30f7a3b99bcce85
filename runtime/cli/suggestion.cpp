// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/suggestion.h"

#include <algorithm>
#include <cctype>

namespace gsc {

namespace {

constexpr size_t kLongest = 64; // longest word that counts as a misspelling

size_t distance(const std::string& a, const std::string& b)
{
    std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); ++j)
        last[j] = j;
    for (size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before.swap(last);
        last.swap(row);
    }
    return last[b.size()];
}

std::string lowerCase(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

} // namespace

std::string nearestWord(const std::string& word, const std::vector<std::string>& known)
{
    if (word.empty() || word.size() > kLongest)
        return "";
    const std::string lower = lowerCase(word);
    std::string best;
    size_t least = std::max<size_t>(1, (lower.size() - std::min(lower.size(), lower.find_first_not_of('-'))) / 3) + 1;
    for (const std::string& candidate : known) {
        const bool starts = lower.size() >= 3 && candidate.rfind(lower, 0) == 0;
        // the beginning of a longer name counts: "--memry" suggests "--memory-budget"
        const std::string head = candidate.substr(0, candidate.find('-', candidate.find_first_not_of('-')));
        const size_t edits =
            starts ? 1 : std::min(distance(lower, candidate), head == candidate ? least : distance(lower, head));
        if (edits < least) {
            least = edits;
            best = candidate;
        }
    }
    return best;
}

std::vector<std::string> nearestWords(const std::string& word, const std::vector<std::string>& known, size_t count)
{
    const std::string lower = lowerCase(word.substr(0, kLongest));
    struct Found {
        size_t edits, differs; // index of the first letter that differs
        const std::string* word;
    };
    std::vector<Found> found;
    for (const std::string& candidate : known) {
        const std::string other = lowerCase(candidate.substr(0, kLongest));
        const auto first = std::mismatch(lower.begin(), lower.end(), other.begin(), other.end()).first;
        found.push_back({distance(lower, other), size_t(first - lower.begin()), &candidate});
    }
    std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
        return a.edits != b.edits ? a.edits < b.edits : a.differs > b.differs;
    });
    std::vector<std::string> words;
    for (size_t i = 0; i < std::min(count, found.size()); ++i)
        words.push_back(*found[i].word);
    return words;
}

std::string listWords(const std::vector<std::string>& words)
{
    std::string text;
    for (size_t i = 0; i < words.size(); ++i)
        text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return text;
}

} // namespace gsc
