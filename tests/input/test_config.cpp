// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;
using Kind = ConfigValue::Kind;

namespace {

ConfigValue parse(const std::string& text)
{
    return parsePythonNamespace(text, "cfg_args");
}

} // namespace

TEST_CASE("cfg_args: values of every kind")
{
    const ConfigValue config = parse("Namespace(a=1, b=-2.5, c=1e-05, d=None, e=True, f=False, g='x', h=[1.0, 'y'], "
                                     "i=(), j=(3,), k={'n': {'m': 7}}, l=inf, m=-inf, n=PosixPath('/a,b'), "
                                     "o=<class 'a.b'>, p=torch.float32, **{'odd-key': 5})\n");
    CHECK(config.getNumber("a", 0, "f") == 1);
    CHECK(config.find("a")->kind == Kind::Int);
    CHECK(config.getNumber("b", 0, "f") == -2.5);
    CHECK(config.getNumber("c", 0, "f") == 1e-05);
    CHECK(config.find("d")->kind == Kind::None);
    CHECK(config.getNumber("d", 9, "f") == 9);
    CHECK(config.getBool("e", false, "f"));
    CHECK_FALSE(config.getBool("f", true, "f"));
    CHECK(config.getString("g", "", "f") == "x");
    CHECK(config.find("h")->list.size() == 2);
    CHECK(config.find("i")->list.empty());
    CHECK(config.find("j")->list.at(0).integer == 3);
    CHECK(config.getNumber("k.n.m", 0, "f") == 7);
    CHECK(std::isinf(config.getNumber("l", 0, "f")));
    CHECK(config.getNumber("m", 0, "f") < 0);
    CHECK(config.find("n")->text == "PosixPath('/a,b')");
    CHECK(config.find("o")->text == "<class 'a.b'>");
    CHECK(config.find("p")->text == "torch.float32");
    CHECK(config.getNumber("odd-key", 0, "f") == 5);
    CHECK(config.find("q") == nullptr);
    CHECK(config.getString("q", "default", "f") == "default");
    CHECK(outcomeOf([&] { (void)config.getBool("g", false, "f"); }).code == ErrorCode::InvalidFile);
}

TEST_CASE("cfg_args, trap 35: paths may hold commas, brackets, equals signs and quotes")
{
    const ConfigValue config =
        parse("Namespace(source_path='/data/a, b) (c=d]', model_path=\"it's\", images='q\\'\"\\\\n\\xe9\\u20ac', "
              "dist2level='floor')");
    CHECK(config.getString("source_path", "", "f") == "/data/a, b) (c=d]");
    CHECK(config.getString("model_path", "", "f") == "it's");
    CHECK(config.getString("images", "", "f") == "q'\"\\n\xc3\xa9\xe2\x82\xac");
    CHECK(config.getString("dist2level", "", "f") == "floor");
}

TEST_CASE("cfg_args, trap 36: upstream's spelling is matched literally")
{
    const ConfigValue config = parse("Namespace(update_hierachy_factor=4, anchor_demon=1)");
    CHECK(config.getNumber("update_hierachy_factor", 0, "f") == 4);
    CHECK(config.find("update_hierarchy_factor") == nullptr);
}

TEST_CASE("cfg_args: numbers may begin with any digit, and escapes name any character")
{
    for (int digit = 0; digit < 10; ++digit)
        CHECK(parse(formatString("Namespace(a=%d)", digit)).getNumber("a", -1, "f") == digit);
    const ConfigValue config =
        parse("Namespace(a='\\x41\\x7f\\x80\\u07ff\\u0800\\uffff\\U00010000\\U0010ffff', b='\\t\\r\\n')");
    CHECK(config.getString("a", "", "f") ==
          "A\x7f\xc2\x80\xdf\xbf\xe0\xa0\x80\xef\xbf\xbf\xf0\x90\x80\x80\xf4\x8f\xbf\xbf");
    CHECK(config.getString("b", "", "f") == "\t\r\n");
    for (const char* unknown : {"Namespace(a='\\q')", "Namespace(a='\\N{DEGREE SIGN}')", "Namespace(a='\\u20g0')"})
        CHECK(outcomeOf([&] { (void)parse(unknown); }).code == ErrorCode::InvalidFile);
}

TEST_CASE("cfg_args: values nest as deep as the message says, in whatever way")
{
    const auto nested = [](int depth, const std::string& open, const std::string& close) {
        std::string text = "1";
        for (int i = 0; i < depth; ++i)
            text = open + text + close;
        return outcomeOf([&] { (void)parse("Namespace(a=" + text + ")"); });
    };
    for (const auto& [open, close] : {std::pair<std::string, std::string>{"[", "]"},
                                      {"(", ",)"},
                                      {"{'b': ", "}"},
                                      {"f(b=", ")"},
                                      {"f(", ")"},
                                      {"f([", "])"}}) {
        CAPTURE(open);
        CHECK(nested(open[0] != 'f'  ? 31
                     : open != "f([" ? 15
                                     : 10,
                     open, close)
                  .code == ErrorCode::Ok); // a call counts twice
        CHECK(nested(33, open, close).says("nested deeper than 32"));
    }
}

TEST_CASE("cfg_args: damaged text is refused, whatever its length")
{
    const std::string text = "Namespace(a=[1, {'b': (2, 'c')}], d='e\\n', f=<g <h>>, i=1e-05, **{'j': None})";
    CHECK(outcomeOf([&] { (void)parse(text); }).code == ErrorCode::Ok);
    for (size_t size = 0; size < text.size(); ++size)
        REQUIRE(outcomeOf([&] { (void)parse(text.substr(0, size)); }).code == ErrorCode::InvalidFile);
    for (size_t i = 0; i < 8 * text.size(); ++i) {
        std::string flipped = text;
        flipped[i / 8] = char(flipped[i / 8] ^ (1 << (i % 8)));
        const ErrorCode code = outcomeOf([&] { (void)parse(flipped); }).code;
        REQUIRE((code == ErrorCode::Ok || code == ErrorCode::InvalidFile));
    }
    CHECK(outcomeOf([] { (void)parse("Namespace(a=" + std::string(100000, '[') + ")"); }).code ==
          ErrorCode::InvalidFile);
    CHECK(outcomeOf([] { (void)parse("Namespace(a=1) b"); }).code == ErrorCode::InvalidFile);
}

TEST_CASE("config.yaml: every way to write nothing, yes and no")
{
    const ConfigValue config = parseYaml("none: [, ~, null, Null, NULL]\nyes: [true, True, TRUE, yes, Yes, on, On]\n"
                                         "no: [false, False, FALSE, no, No, off, Off]\n",
                                         "y");
    for (const ConfigValue& value : config.find("none")->list)
        CHECK(value.kind == Kind::None);
    for (const char* word : {"yes", "no"})
        for (const ConfigValue& value : config.find(word)->list) {
            CHECK(value.kind == Kind::Bool);
            CHECK(value.integer == (word[0] == 'y'));
        }
    CHECK(config.find("yes")->list.size() == 7);
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
