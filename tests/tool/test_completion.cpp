// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/completion.h"
#include "runtime/cli/man_page.h"
#include "tests/tool/tree.h"

#include <doctest/doctest.h>

using namespace gsc;

namespace {

std::string completed(const std::vector<std::string>& words)
{
    const Tree tree;
    return completions(tree.app, words);
}

} // namespace

TEST_CASE("commands, options and values are completed")
{
    CHECK(completed({""}) == "make\tMake it\nsample\tSample it\n");
    CHECK(completed({"ma"}) == "make\tMake it\n");
    CHECK(completed({"sample", ""}) == "city\tA city\n");
    CHECK(completed({"make", "--m"}) == "--mode\thow\n--memory-budget\thow much\n");
    CHECK(completed({"make", "--mode", "exact", "--m"}) == "--memory-budget\thow much\n"); // once is enough
    CHECK(completed({"make", "--mode", ""}) == "fast\nexact\n");
    CHECK(completed({"make", "--mode", "e"}) == "exact\n");
    CHECK(completed({"make", "--mode="}) == "--mode=fast\n--mode=exact\n");
    CHECK(completed({"make", "--nonsense", "--mode=e"}) == "--mode=exact\n");
    CHECK(completed({"make", "-q", "--q"}).empty());
    CHECK(completed({"make", "--whole", "--r"}).empty());                              // excluded
    CHECK(completed({"sample", "city", "--only", "walk", "--o"}) == "--only\tsome\n"); // takes several
    CHECK(completed({"nonsense", "--"}).find("--version") != std::string::npos);
}

TEST_CASE("files are completed by kind")
{
    CHECK(completed({"make", ""}) == ":folders\n:files .ply\n");
    CHECK(completed({"make", "a", "-o", ""}) == ":files .gsc\n");
    CHECK(completed({"make", "a", ""}).empty()); // takes one word
    CHECK(completed({"sample", "city", "x", "--only", "walk", "o"}) == "orbit\n");
}

TEST_CASE("help and man take commands and nothing else")
{
    Tree tree;
    std::vector<std::string> words;
    gsc::addTexts(*tree.app.add_subcommand("help", "Help"), "COMMAND", words, "COMMAND", "the command");
    CHECK(completions(tree.app, {"help", "s"}) == "sample\tSample it\n");
    CHECK(completions(tree.app, {"help", "sample", ""}) == "city\tA city\n");
    for (const char* word : {"make", "city", "nonsense"})
        CHECK_MESSAGE(completions(tree.app, {"help", word, ""}).empty(), word);
}

TEST_CASE("a manual page holds every option and survives roff")
{
    const Tree tree;
    const std::string page = manPage(*tree.make);
    for (const char* part : {".TH \"PROG\\-MAKE\" 1", ".SH SYNOPSIS", "\\-\\-memory\\-budget", "FILE.gsc",
                             "\\fBINPUT\\fR", "\\fB\\-i, \\-\\-input\\fR MODEL|FILE.ply"})
        CHECK_MESSAGE(page.find(part) != std::string::npos, part);
    CHECK(manPage(tree.app).find("\\fBprog\\-sample\\fR(1)") != std::string::npos);
    CHECK(page.find(".SH NOTES") == std::string::npos);
    tree.make->footer("exit codes\n0  done");
    CHECK(manPage(*tree.make).find(".SH NOTES\n.nf\nexit codes\n0  done\n.fi\n") != std::string::npos);
}
