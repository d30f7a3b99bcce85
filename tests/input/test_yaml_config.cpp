// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <cmath>
#include <iterator>

using namespace gsc;
using namespace gsc::test;
using Kind = ConfigValue::Kind;

TEST_CASE("config.yaml: keys that a web page gave a blank of its own")
{
    for (const char* text : {"\u00a0a: 1", "a\u00a0: 1", "b: {\u200ba: 1}", "b: [{\ufeffa: 1}]"}) {
        CAPTURE(text);
        const Outcome outcome = outcomeOf([&] { (void)parseYaml(text, "y"); });
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says("U+"));
    }
    CHECK(parseYaml("a: caf\u00e9\u00a0", "y").find("a")->kind == Kind::String);
}

TEST_CASE("config.yaml: every way to write nothing, yes and no")
{
    const ConfigValue config = parseYaml("none: [, ~, null, Null, NULL, !!null ~, !!null null, !!null Null]\n"
                                         "yes: [true, True, TRUE, yes, Yes, YES, on, On, ON]\n"
                                         "no: [false, False, FALSE, no, No, NO, off, Off, OFF]\n",
                                         "y");
    for (const ConfigValue& value : config.find("none")->list)
        CHECK(value.kind == Kind::None);
    for (const char* word : {"yes", "no"})
        for (const ConfigValue& value : config.find(word)->list) {
            CHECK(value.kind == Kind::Bool);
            CHECK(value.integer == (word[0] == 'y'));
        }
    CHECK(config.find("yes")->list.size() == 9);
}

TEST_CASE("config.yaml: numbers of YAML 1.1, tags, anchors and merged dictionaries")
{
    const ConfigValue config =
        parseYaml("base: &base {fork: 3, dist2level: ceil}\nmore: &more {fork: 4, levels: 7}\n"
                  "one: {<<: *base, fork: 2}\ntwo: {<<: [*base, *more]}\nsame: *base\n"
                  "numbers: [0x1F, 0b11, 017, -0x10, 1:30, 1_000, 1.5e+3, 1e-3, .5, 0, -0, 0.25, 1:00:01]\n"
                  "text: [08, 0x, 1:x, '1', !!str 1, \"yes\", 1.2.3, v1, 2024-01-02]\n"
                  "wide: [.inf, -.Inf, +.INF]\nnone: .nan\ntuple: !!python/tuple [1, 2]\ndotted: {a: 1, a: 2}\n",
                  "y");
    CHECK(config.find("one.fork")->integer == 2);
    CHECK(config.find("one.dist2level")->text == "ceil");
    CHECK(config.find("two.fork")->integer == 3);
    CHECK(config.find("two.levels")->integer == 7);
    CHECK(config.find("same.fork")->integer == 3);
    const double numbers[] = {31, 3, 15, -16, 90, 1000, 1500, 1e-3, 0.5, 0, 0, 0.25, 3601};
    for (size_t i = 0; i < std::size(numbers); ++i) {
        CAPTURE(i);
        CHECK(config.find("numbers")->list.at(i).kind != Kind::String);
        CHECK(config.find("numbers")->list.at(i).number == numbers[i]);
    }
    for (const ConfigValue& value : config.find("text")->list) {
        CAPTURE(value.text);
        CHECK(value.kind == Kind::String);
    }
    for (const ConfigValue& value : config.find("wide")->list)
        CHECK(std::isinf(value.number));
    CHECK(std::isnan(config.find("none")->number));
    CHECK(config.find("tuple")->list.size() == 2);
    CHECK(config.find("dotted.a")->integer == 2);
}

TEST_CASE("config.yaml: flow and block style, comments, numbers as PyYAML reads them")
{
    const ConfigValue config =
        parseYaml("# comment\nmodel_params: {\n  model_config: {\n    name: \"GaussianLoDModel\",\n"
                  "    kwargs: {fork: 2, dist2level: 'round', progressive: True, levels: -1,}\n"
                  "  },\n  white_background: False,\n}\noptim_params:\n  iterations: 40_000\n"
                  "  coarse_factor: 1.5\n  none: ~\n  text: \"12\"\n  list: [1.0, no]\n",
                  "config.yaml");
    const std::string f = "config.yaml";
    CHECK(config.getString("model_params.model_config.name", "", f) == "GaussianLoDModel");
    CHECK(config.getNumber("model_params.model_config.kwargs.fork", 0, f) == 2);
    CHECK(config.getString("model_params.model_config.kwargs.dist2level", "", f) == "round");
    CHECK(config.getBool("model_params.model_config.kwargs.progressive", false, f));
    CHECK(config.getNumber("model_params.model_config.kwargs.levels", 0, f) == -1);
    CHECK_FALSE(config.getBool("model_params.white_background", true, f));
    CHECK(config.getNumber("optim_params.iterations", 0, f) == 40000);
    CHECK(config.getNumber("optim_params.coarse_factor", 0, f) == 1.5);
    CHECK(config.find("optim_params.none")->kind == Kind::None);
    CHECK(config.find("optim_params.text")->kind == Kind::String);
    CHECK(config.find("optim_params.iterations")->kind == Kind::Int);
    CHECK(config.find("optim_params.iterations")->integer == 40000);
    CHECK(config.find("optim_params.coarse_factor")->kind == Kind::Float);
    CHECK(config.find("optim_params.list")->list.at(1).kind == Kind::Bool);
    CHECK(outcomeOf([] { (void)parseYaml("a: [1, {b: ", "y"); }).code == ErrorCode::InvalidFile);
    const auto listOf = [](size_t count) {
        std::string list = "a: [";
        for (size_t i = 0; i < count; ++i)
            list += "1,";
        return outcomeOf([&] { (void)parseYaml(list + "]\n", "y"); });
    };
    CHECK(listOf(19998).code == ErrorCode::Ok); // beside the list and what holds it
    CHECK(listOf(19999).says("too many"));
    std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
    for (int i = 1; i < 9; ++i) {
        bomb += formatString("a%d: &a%d [*a%d", i, i, i - 1);
        for (int j = 0; j < 8; ++j)
            bomb += formatString(", *a%d", i - 1);
        bomb += "]\n";
    }
    CHECK(outcomeOf([&] { (void)parseYaml(bomb, "y"); }).code == ErrorCode::InvalidFile);
}
