// SPDX-License-Identifier: Apache-2.0
#include <gsc/frame_stats.h>
#include "tests/support/source_folder.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <limits>
#include <string>

using namespace gsc;
using Json = nlohmann::json;

namespace {

// The part of JSON schema that frame-stats.schema.json uses: types, required and closed objects, $ref.
void checkAgainst(const Json& schema, const Json& root, const Json& value, const std::string& at)
{
    CAPTURE(at);
    if (schema.contains("$ref")) {
        checkAgainst(root.at(Json::json_pointer(schema["$ref"].get<std::string>().substr(1))), root, value, at);
        return;
    }
    if (schema.contains("const"))
        CHECK(value == schema["const"]);
    if (schema.contains("enum"))
        CHECK(std::find(schema["enum"].begin(), schema["enum"].end(), value) != schema["enum"].end());
    const Json type = schema.value("type", Json());
    if (type == "object") {
        REQUIRE(value.is_object());
        for (const Json& key : schema["required"])
            CHECK(value.contains(key.get<std::string>()));
        for (const auto& [key, child] : value.items()) {
            REQUIRE(schema["properties"].contains(key));
            checkAgainst(schema["properties"][key], root, child, at + "/" + key);
        }
    } else if (type == "array") {
        REQUIRE(value.is_array());
        CHECK(value.size() >= schema.value("minItems", size_t(0)));
        for (const Json& child : value)
            checkAgainst(schema["items"], root, child, at + "/*");
    } else if (type == "integer") {
        CHECK(value.is_number_integer());
    } else if (type == "number") {
        CHECK(value.is_number());
    } else if (type == "string") {
        CHECK(value.is_string());
    }
}

Json frameSchema()
{
    std::ifstream stream(test::sourceFolder() + "/schemas/frame-stats.schema.json");
    return Json::parse(stream);
}

FrameStats someStats()
{
    FrameStats stats;
    stats.frame = 12;
    stats.camera = "a \"b\"\n";
    stats.backend = "cpu";
    stats.width = 20;
    stats.height = 10;
    stats.eye_count = 2;
    stats.appearance = 3;
    stats.result.times.blend = 1.5;
    stats.result.times.total = 2;
    stats.result.eyes[1].pairs = uint64_t(1) << 40;
    stats.result.eyes[1].blend_evaluations = 500;
    stats.result.eyes[1].anchors_overdue = 6;
    stats.result.repeats = 2;
    stats.result.repeat_ms = 1.25;
    stats.result.cache_bytes = 8;
    stats.result.cache_evictions = 9;
    stats.lod_bias = -0.5;
    stats.detail = 1.5;
    stats.result.coarse = {11, 12, 13, 14};
    return stats;
}

} // namespace

TEST_CASE("a line of statistics fits its schema and carries every value")
{
    const std::string line = frameStatsJson(someStats());
    CHECK(line.find('\n') == std::string::npos);
    const Json json = Json::parse(line);
    const Json schema = frameSchema();
    checkAgainst(schema, schema, json, "");
    CHECK(json["camera"] == "a \"b\"\n");
    CHECK(json["ms"]["blend"] == 1.5);
    CHECK(json["eyes"].size() == 2);
    CHECK(json["eyes"][1]["pairs"] == uint64_t(1) << 40);
    CHECK(json["eyes"][1]["blend_evaluations_per_pixel"] == 2.5);
    CHECK(json["eyes"][1]["anchors_overdue"] == 6);
    CHECK(json["repeats"] == 2);
    CHECK(json["repeat_ms"] == 1.25);
    CHECK(json["cache_bytes"] == 8);
    CHECK(json["cache_evictions"] == 9);
    CHECK(json["lod_bias"] == -0.5);
    CHECK(json["detail"] == 1.5);
    CHECK(json["groups_near"] == 11);
    CHECK(json["groups_kept"] == 12);
    CHECK(json["groups_stale"] == 13);
    CHECK(json["groups_made"] == 14);
    CHECK(json["appearance"] == 3);
    CHECK(json["tier"] == "exact");
}

TEST_CASE("no appearance is null, one eye is one entry, bytes that are no UTF-8 are replaced")
{
    FrameStats stats = someStats();
    stats.appearance = -1;
    stats.eye_count = 1;
    stats.camera = "\xff\xfe";
    stats.tier = Tier::Fast;
    const Json json = Json::parse(frameStatsJson(stats));
    CHECK(json["appearance"].is_null());
    CHECK(json["eyes"].size() == 1);
    CHECK(json["tier"] == "fast");
    CHECK(json["camera"] == "\xef\xbf\xbd\xef\xbf\xbd");
}
