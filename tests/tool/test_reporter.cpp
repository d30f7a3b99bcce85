// SPDX-License-Identifier: Apache-2.0
#include "player/tool/tool.h"

#include <doctest/doctest.h>

using namespace gsc;

TEST_CASE("an error's parts are told apart where it has them")
{
    const OrderedJson whole = errorJson(ErrorCode::Io, "a/b: gone (why, so), expected a file; check it; or not");
    CHECK(whole["code"] == "Io");
    CHECK(whole["exit_code"] == 2);
    CHECK(whole["found"] == "gone (why, so)");
    CHECK(whole["expected"] == "a file");
    CHECK(whole["remedy"] == "check it; or not");
    for (const char* message : {"plain", "a: b", "a: b, expected c", ", expected c; d", ""}) {
        const OrderedJson part = errorJson(ErrorCode::Internal, message);
        CHECK(part["message"] == message);
        CHECK(part["found"].is_null());
    }
}
