// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cli/command_words.h"
#include "runtime/cli/printed_command.h"
#include "runtime/cli/suggestion.h"
#include "tests/tool/tree.h"

#include <doctest/doctest.h>

using namespace gsc;

namespace {

// The message, empty if the words fit.
std::string problem(const std::vector<std::string>& words)
{
    Tree tree;
    try {
        (void)checkWords(tree.app, words);
        return "";
    } catch (const Error& e) {
        CHECK(e.code() == ErrorCode::Usage);
        return e.what();
    }
}

Tree& parsed(Tree& tree, const std::vector<std::string>& words)
{
    giveWords(tree.app, checkWords(tree.app, words));
    return tree;
}

bool holds(const std::string& text, const char* part)
{
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("words that fit, in every form")
{
    for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
             {"make", "a", "-o", "b", "--mode", "exact", "-vvq"},
             {"make", "-o", "b", "-i", "a", "--mode=exact", "-q", "-v", "-v"},
             {"make", "-ob", "--input=a", "-v", "--mode", "exact", "-qv"},
             {"make", "--quiet", "--verbose", "--verbose", "--output=b", "--mode", "exact", "--", "a"}}) {
        Tree tree;
        parsed(tree, words);
        CHECK(tree.input == "a");
        CHECK(tree.output == "b");
        CHECK(tree.mode == 2);
        CHECK(tree.quiet);
        CHECK(tree.verbose == 2);
    }
    Tree several;
    parsed(several, {"sample", "city", "--only", "walk", "orbit", "m.gsc"});
    CHECK(several.many == std::vector<std::string>{"walk", "orbit"});
    CHECK(several.input == "m.gsc");
    Tree folder; // folder with the name of a command
    CHECK(parsed(folder, {"make", "sample", "-o", "city"}).input == "sample");
}

TEST_CASE("what does not fit is named, with what was meant")
{
    CHECK(holds(problem({"mkae"}), "mkae: no command of prog, expected make or sample; did you mean make?"));
    CHECK(holds(problem({"sample", "ciyt"}), "did you mean city?"));
    CHECK(holds(problem({"sample", "mountain"}), "see prog sample --help"));
    CHECK(holds(problem({"make", "a", "--outptu", "b"}), "did you mean --output?"));
    CHECK(holds(problem({"make", "a", "--memry", "2"}), "did you mean --memory-budget?"));
    CHECK(holds(problem({"make", "a", "--only", "walk"}), "prog sample city has it"));
    CHECK(holds(problem({"make", "a", "--nothing=3"}), "--nothing: unknown option, expected an option of prog make"));
    CHECK(holds(problem({"make", "a", "-x"}), "-x: unknown option"));
    CHECK(holds(problem({"--quiet", "make"}), "--quiet: unknown option"));
    CHECK(holds(problem({"make", "a", "b", "-o", "c"}), "b: one word too many, expected 1"));
    CHECK(holds(problem({"make", "a", "-i", "b", "-o", "c"}), "--input: given twice"));
    CHECK(holds(problem({"make", "-o", "c"}), "INPUT: not given, expected it behind prog make; see prog make --help"));
    CHECK(holds(problem({"make", "a"}), "--output: not given, expected --output FILE.gsc"));
    CHECK(holds(problem({"make", "a", "-o"}), "--output: no value given"));
    CHECK(holds(problem({"make", "-o", "--quiet", "a"}), "--output: no value given"));
    CHECK(holds(problem({"make", "a", "-o", "b", "-o", "c"}), "--output: given twice, expected once"));
    CHECK(holds(problem({"make", "a", "-o", ""}), "--output: an empty value"));
    CHECK(holds(problem({"make", "", "-o", "b"}), "INPUT: an empty word"));
    CHECK(holds(problem({"make", "a", "-o", "b", "--quiet=3"}), "--quiet=3: a value behind a flag"));
    CHECK(holds(problem({"make", "a", "-o", "b", "--memory-budget", "1"}), "has no effect without --report"));
    CHECK(holds(problem({"make", "a", "-o", "b", "--whole", "--report", "r"}), "together with --"));
}

TEST_CASE("help and version miss nothing")
{
    Tree tree;
    CHECK(checkWords(tree.app, {"make", "--help"}).help);
    CHECK(checkWords(tree.app, {"make", "--help"}).command == tree.make);
    CHECK(checkWords(tree.app, {"--version"}).version);
    CHECK_FALSE(checkWords(tree.app, {}).help);
}

TEST_CASE("nearestWord: edits, swaps, heads and starts, and nothing far off")
{
    const std::vector<std::string> known = {"--size", "--seed", "--memory-budget"};
    CHECK(nearestWord("--sise", known) == "--size");
    CHECK(nearestWord("--SIZE", known) == "--size");
    CHECK(nearestWord("--sede", known) == "--seed");
    CHECK(nearestWord("--memory", known) == "--memory-budget");
    CHECK(nearestWord("--x", known).empty());
    CHECK(nearestWord("wxyz", {"abyz", "bayz"}).empty()); // no swap
    CHECK(nearestWord("", known).empty());
    CHECK(nearestWord(std::string(100000, 'a'), known).empty());
    CHECK(listWords({}).empty());
    CHECK(listWords({"a"}) == "a");
    CHECK(listWords({"a", "b", "c"}) == "a, b or c");
}

TEST_CASE("words of printed commands are quoted where a shell would split or change them")
{
    for (const char* plain : {"a", "../a-b_1.gsc", "str\u00e9e", "/a,b:c=d@e%f+g"})
        CHECK(shellWord(plain) == plain);
    CHECK(shellWord("") == "''");
    CHECK(shellWord("a b") == "'a b'");
    CHECK(shellWord("it's $HOME") == "'it'\\''s $HOME'");
    for (const char* word : {"~a", "a*", "a;b", "(a)", "a\tb", "a\nb", "#a", "a\\b", "a\"b", "!a", "{a,b}"})
        CHECK(shellWord(word) == "'" + std::string(word) + "'");
}

TEST_CASE("advice of gsc convert says so, where it names an option")
{
    CHECK(convertAdvice("pass --fork") == "pass --fork (to gsc convert)");
    CHECK(convertAdvice("pass the folder with --scene-dir") == "pass the folder with --scene-dir (to gsc convert)");
    for (const char* other :
         {"train it again", "pass --size", "gsc convert has no such option, gsc-play --cameras has"})
        CHECK(convertAdvice(other) == other);
}
