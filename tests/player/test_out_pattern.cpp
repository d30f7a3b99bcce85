// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "player/output/out_pattern.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

std::string refusal(const std::string& pattern)
{
    const Outcome refused = outcomeOf([&] { (void)expandPattern(pattern, "x", 0, Eye::Mono); });
    CHECK(refused.code == (refused.message.empty() ? ErrorCode::Ok : ErrorCode::Usage));
    return refused.message;
}

std::string collision(const std::string& pattern, const std::vector<OutputFrame>& frames, int eyes)
{
    const Outcome refused = outcomeOf([&] { (void)outputPaths(pattern, frames, eyes); });
    CHECK(refused.code == (refused.message.empty() ? ErrorCode::Ok : ErrorCode::Usage));
    return refused.message;
}

} // namespace

TEST_CASE("placeholders are filled in")
{
    CHECK(expandPattern("o/{name}.png", "IMG_1", 7, Eye::Mono) == "o/IMG_1.png");
    CHECK(expandPattern("{frame}_{frame:04}_{frame:2}", "x", 7, Eye::Mono) == "7_0007_07");
    CHECK(expandPattern("{frame:04}", "x", 123456, Eye::Mono) == "123456");
    CHECK(expandPattern("{eye}", "x", 0, Eye::Left) == "left");
    CHECK(expandPattern("{eye}", "x", 0, Eye::Right) == "right");
    CHECK(expandPattern("{eye}", "x", 0, Eye::Mono) == "mono");
    CHECK(expandPattern("a{{b}}c%d", "x", 0, Eye::Mono) == "a{b}c%d");
}

TEST_CASE("what is no placeholder is refused")
{
    CHECK(refusal("{nam}.png").find("{nam}") != std::string::npos);
    CHECK(refusal("{frame:xx}").find("{frame:04}") != std::string::npos);
    CHECK(refusal("{frame:999}") != "");
    CHECK(refusal("{frame:}") != "");
    CHECK(refusal("{name") != "");
    CHECK(refusal("name}") != "");
    CHECK(refusal("{}") != "");
    CHECK(refusal("{{name}}") == "");
}

TEST_CASE("a camera's name cannot leave the folder")
{
    CHECK(safeFileName("../../etc/passwd") == "_._.._etc_passwd");
    CHECK(safeFileName("..") == "_.");
    CHECK(safeFileName("a\\b:c\nd") == "a_b_c_d");
    CHECK(safeFileName("") == "_");
    CHECK(safeFileName(".hidden") == "_hidden");
    CHECK(safeFileName("K\xc3\xb6ln 1.jpg") == "K\xc3\xb6ln 1.jpg");
    CHECK(expandPattern("o/{name}.png", "../x", 0, Eye::Mono) == "o/_._x.png");
}

TEST_CASE("two frames never go to the same file")
{
    const std::vector<OutputFrame> frames = {{"a", 4}, {"b", 5}, {"a", 6}};
    CHECK(outputPaths("{frame}_{eye}.png", frames, 2) == std::vector<std::string>{"4_left.png", "4_right.png",
                                                                                  "5_left.png", "5_right.png",
                                                                                  "6_left.png", "6_right.png"});
    CHECK(collision("{name}.png", frames, 1).find("add {frame}") != std::string::npos);
    CHECK(collision("{name}.png", frames, 1).find("frames 4 (a) and 6 (a)") != std::string::npos);
    CHECK(collision("{frame}.png", frames, 2).find("add {eye}") != std::string::npos);
    CHECK(collision("x.png", frames, 1) != "");
    CHECK(collision("x.png", {{"a", 0}}, 1) == "");
    // names that only become equal when made safe
    CHECK(collision("{name}.png", {{"a/b", 0}, {"a:b", 1}}, 1) != "");
}
