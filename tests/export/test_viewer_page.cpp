// SPDX-License-Identifier: Apache-2.0
// The page of gsc export --html, as text; tests/viewers opens it.
#include "convert/viewer/viewer_page.h"

#include <doctest/doctest.h>

#include <span>
#include <string>

using namespace gsc;

namespace {

std::string pageOf(const std::string& name, const std::string& bytes)
{
    const nlohmann::ordered_json model = {{"name", name}, {"cameras", {{{"name", name}}}}};
    return viewerPage(model, std::as_bytes(std::span(bytes)));
}

size_t occurrences(const std::string& text, const std::string& word)
{
    size_t count = 0;
    for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
        ++count;
    return count;
}

// Text between `before`, which occurs once, and the next `after`.
std::string between(const std::string& text, const std::string& before, const std::string& after)
{
    REQUIRE(occurrences(text, before) == 1);
    const size_t first = text.find(before) + before.size();
    return text.substr(first, text.find(after, first) - first);
}

} // namespace

TEST_CASE("the page holds model and engine, and asks no network")
{
    const std::string page = pageOf("room", "model");
    CHECK(page.starts_with("<!DOCTYPE html>"));
    CHECK(page.size() > 2500000);
    CHECK(page.find("@ENGINE@") == std::string::npos);
    CHECK(between(page, "<title>", "</title>") == "room");
    CHECK(between(page, "default-src ", ";") == "'none'");
    CHECK(between(page, "connect-src ", "\">") == "data: blob:"); // nothing that lies elsewhere
    CHECK(occurrences(page, "<script src") + occurrences(page, "<link") == 0);
    CHECK(page.find("Permission is hereby granted") != std::string::npos); // the engine's licence comes along
    CHECK(page == pageOf("room", "model"));
}

TEST_CASE("the model is base64, whatever its length")
{
    const std::string before = "id=\"sog\">", after = "</script>";
    CHECK(between(pageOf("a", "light work."), before, after) == "bGlnaHQgd29yay4=");
    CHECK(between(pageOf("a", "light work"), before, after) == "bGlnaHQgd29yaw==");
    CHECK(between(pageOf("a", "light wor"), before, after) == "bGlnaHQgd29y");
    CHECK(between(pageOf("a", "\xff\xfe\xfb"), before, after) == "//77");
}

TEST_CASE("no name ends an element or begins one")
{
    const std::string plain = pageOf("room", "m"), hostile = pageOf("</script><script>alert(1)</script><!--&amp;", "m");
    for (const char* word : {"<script", "</script", "<!--"})
        CHECK(occurrences(hostile, word) == occurrences(plain, word));
    CHECK(between(hostile, "<title>", "</title>") == "&lt;/script>&lt;script>alert(1)&lt;/script>&lt;!--&amp;amp;");
}
