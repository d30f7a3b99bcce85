// SPDX-License-Identifier: Apache-2.0
#include "convert/input/config/config_value.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <cmath>
#include <iterator>

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
    CHECK(outcomeOf([&] { (void)config.getNumber("g", 0, "f"); }).code == ErrorCode::Unsupported);
    CHECK(outcomeOf([&] { (void)config.getBool("p", false, "f"); }).says("is the expression 'torch.float32'"));
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
    for (const char* unknown : {"Namespace(a='\\N')", "Namespace(a='\\N{DEGREE SIGN')", "Namespace(a='\\u20g0')",
                                "Namespace(a='\\x4')", "Namespace(a='\\U00110000')"})
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

TEST_CASE("cfg_args: every literal of Python has its value")
{
    const auto value = [](const std::string& text) { return *parse("Namespace(a=" + text + ")").find("a"); };
    const auto number = [&](const std::string& text) {
        const ConfigValue found = value(text);
        CHECK((found.kind == Kind::Int || found.kind == Kind::Float));
        return found.number;
    };
    CHECK(number("1_000") == 1000);
    CHECK(number("0x_fF") == 255);
    CHECK(number("0o17") == 15);
    CHECK(number("0B101") == 5);
    CHECK(number("00") == 0);
    CHECK(number("1_0.2_5e-1_0") == 10.25e-10);
    CHECK(number(".5") == 0.5);
    CHECK(number("5.") == 5);
    CHECK(number("1e3") == 1000);
    CHECK(number("01.5") == 1.5);
    CHECK(number("- - 2") == 2);
    CHECK(number("-+-~0") == -1);
    CHECK(number("123456789012345678901234567890") == 123456789012345678901234567890.0);
    CHECK(value("7").integer == 7);
    CHECK(value("-0x10").integer == -16);
    CHECK(value("(-1)").integer == -1);
    CHECK(value("not True").kind == Kind::Bool);
    CHECK_FALSE(value("not 'x'").isTrue());
    CHECK(value("not []").isTrue());
    const auto text = [&](const std::string& source) {
        const ConfigValue found = value(source);
        CHECK(found.kind == Kind::String);
        return found.text;
    };
    CHECK(text("r'C:\\new\\x'") == "C:\\new\\x");
    CHECK(text("'C:\\data\\q'") == "C:\\data\\q"); // Python keeps escapes that it does not know
    CHECK(text("u'a' \"b\"\n'c'") == "abc");
    CHECK(text("('a'\n 'b')") == "ab");
    CHECK(text("'''a'b\nc'''") == "a'b\nc");
    CHECK(text("\"\"\"a\"\"\"") == "a");
    CHECK(text("''") == "");
    CHECK(text("'\\101\\60\\0\\a\\b\\f\\v'") == std::string("A0\0\a\b\f\v", 7));
    CHECK(text("'a\\\nb'") == "ab");
    CHECK(text("'\\udce9\\ud800'") == "\xe9\xef\xbf\xbd"); // a byte that was no UTF-8; half a character
    CHECK(text("'\xe9'") == "\xe9");                       // as a trainer on Windows writes it
    CHECK(value("('a', 1,)").list.size() == 2);
    CHECK(value("{'b': 1, **{'c': 2}}").find("c")->integer == 2);
    CHECK(value("Namespace(b=Namespace(c=3))").find("b.c")->integer == 3);
}

TEST_CASE("cfg_args: comments, line ends, and brackets as an editor leaves them")
{
    for (const char* text :
         {"Namespace(a=1)", "  Namespace(a=1)\n\n", "Namespace(\r\n  a=1,  # a comment (\r\n)\r\n",
          "# first\nNamespace(a=1)", "(Namespace(a=1))", "argparse.Namespace(a=1)", "Namespace ( a = 1 , )",
          "Namespace(**{'a': 1})", "Namespace(**{**{'a': 1}})", "Namespace(\\\na=1)", "\tNamespace(a=1) # end"})
        CHECK(parse(text).getNumber("a", 0, "f") == 1);
    CHECK(parse("Namespace()").keys.empty());
}

TEST_CASE("cfg_args: expressions are kept where nothing needs them, and refused as unsupported where something does")
{
    for (const char* expression : {"1+1",
                                   "2**3",
                                   "1j",
                                   "1 if True else 2",
                                   "[x for x in y]",
                                   "{x: 1 for x in y if x}",
                                   "{1, 2}",
                                   "(x for x in y)",
                                   "b'a'",
                                   "f'{a}'",
                                   "rb'a'",
                                   "'a' b'c'",
                                   "a.b.c",
                                   "a[1:2, ...]",
                                   "a[b](c)(d)",
                                   "f(1, *b, **c)",
                                   "f(x for x in y)",
                                   "lambda: 0",
                                   "lambda x, *y, z=1, **w: x",
                                   "a < b < c",
                                   "a is not b",
                                   "a not in b",
                                   "not a and b or c",
                                   "...",
                                   "(b := 1)",
                                   "os.path.join('a', 'b')",
                                   "PosixPath('/a')",
                                   "float('inf')",
                                   "'%s' % a",
                                   "1 < 2",
                                   "-a",
                                   "(*a, b)",
                                   "[*a]",
                                   "{**a}",
                                   "{*a}",
                                   "'\\N{DEGREE SIGN}'",
                                   "<class 'a'>",
                                   "array([1., 2.])",
                                   "tensor(1)",
                                   "int",
                                   "1 @ a",
                                   "await a",
                                   "(yield)",
                                   "[a for a in b for c in d if e if f]",
                                   "[a async for a in b]",
                                   "datetime.date(2024, 1, 2)"}) {
        CAPTURE(expression);
        const ConfigValue config = parse("Namespace(a=" + std::string(expression) + ", b=2)");
        CHECK(config.getNumber("b", 0, "f") == 2);
        CHECK(config.find("a")->kind == Kind::Other);
        const Outcome outcome = outcomeOf([&] { (void)config.getNumber("a", 0, "f"); });
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK(outcome.says("is the expression"));
    }
    for (const char* text : {"{'a': 1}", "dict(a=1)", "Namespace(a=1),", "Namespace(a=1).a", "Namespace(**a)", "[1]",
                             "1", "'Namespace(a=1)'", "Namespace(a=1) or Namespace(b=2)", "vars(Namespace(a=1))"})
        CHECK(outcomeOf([&] { (void)parse(text); }).code == ErrorCode::Unsupported);
    for (const char* text : {"Namespace(a=01)",
                             "Namespace(a=1__0)",
                             "Namespace(a=1_)",
                             "Namespace(a=0x)",
                             "Namespace(a=)",
                             "Namespace(a=1, a=2)",
                             "Namespace(a=1 b=2)",
                             "Namespace(a='x' 1)",
                             "Namespace(a='\n')",
                             "Namespace(a=$b)",
                             "Namespace(a=1))",
                             "Namespace[a=1]",
                             "a: 1",
                             "Namespace(a=1)(",
                             "",
                             "#",
                             "Namespace",
                             "Namespace(a=if)",
                             "Namespace(a=1 if b)",
                             "Namespace(a=[x for])",
                             "Namespace(1x)"}) {
        CAPTURE(text);
        CHECK(outcomeOf([&] { (void)parse(text); }).code == ErrorCode::InvalidFile);
    }
}

TEST_CASE("cfg_args: a Namespace takes named values only, each once")
{
    const std::string generator = "(x for x in y)"; // the call's own brackets
    for (const std::string& text :
         {std::string("Namespace(a==True)"), std::string("Namespace(a:=True)"), std::string("Namespace(True)"),
          std::string("Namespace(b=1, *['a'])"), std::string("Namespace('a')"), "Namespace" + generator,
          std::string("argparse.Namespace(b=1, 2)"), std::string("Namespace(b=Namespace(1))"),
          std::string("Namespace(a=False, **{'a': True})"), std::string("Namespace(**{'a': 1}, a=2)"),
          std::string("Namespace(**{'a': 1}, **{'a': 1})"), std::string("Namespace(None=1)"),
          std::string("Namespace(True=1)"), std::string("Namespace(b=1, False=1)"), std::string("Namespace(b=a.None)"),
          std::string("Namespace(b=dict(True=1))")}) {
        CAPTURE(text);
        const Outcome outcome = outcomeOf([&] { (void)parse(text); });
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says("cfg_args: "));
    }
    CHECK(outcomeOf([] { (void)parse("Namespace(a==True)"); }).says("'a==True' has no name at byte 10"));
    CHECK(outcomeOf([] { (void)parse("Namespace(a=0, **{'a': 1})"); }).says("'a' given twice"));
    CHECK(parse("Namespace(**{'a': 1, 'a': 2})").getNumber("a", 0, "f") == 2);
    CHECK(parse("Namespace(a=1, **{'b': 2}, **dict(c=3))").getNumber("c", 0, "f") == 3);
    for (const char* text : {"Namespace(**{a: 1})", "Namespace(b=1, **{1: 2})", "Namespace(**{('a'): 1, None: 2})"})
        CHECK(outcomeOf([&] { (void)parse(text); }).code == ErrorCode::Unsupported);
    CHECK(parse("Namespace(b={1: 2}, a=2)").getNumber("a", 0, "f") == 2);
    CHECK(parse("Namespace(b=f(1, *c), a=2)").getNumber("a", 0, "f") == 2); // others may take what they like
}

TEST_CASE("cfg_args: characters that no name of Python's has are refused by their number")
{
    const std::pair<const char*, const char*> characters[] = {{"\u00a0", "U+00A0"},
                                                              {"\u200b", "U+200B"},
                                                              {"\ufeff", "U+FEFF"},
                                                              {"\uff1d", "U+FF1D"},
                                                              {"\u2018", "U+2018"},
                                                              {"\u0430", "U+0430"},
                                                              {"\U0001f600", "U+1F600"},
                                                              {"\xa0", "byte 0xA0"},
                                                              {"\xe2\x80", "byte 0xE2"},
                                                              {"\xc0\xa0", "byte 0xC0"},
                                                              {"\x01", "U+0001"},
                                                              {"$", "'$'"},
                                                              {"?", "'?'"}};
    for (const auto& [bytes, name] : characters) {
        const std::string c = bytes;
        CAPTURE(name);
        for (const std::string& text : {"Namespace(" + c + "a=1)", "Namespace(a" + c + "=1)", "Namespace(a=1" + c + ")",
                                        "Namespace(b=1, " + c + "a=1)", c + "Namespace(a=1)", "Namespace(a=1)" + c,
                                        "Namespace(a=" + c + "b" + c + ")", "Namespace(a=0x1" + c + ")"}) {
            CAPTURE(text);
            const Outcome outcome = outcomeOf([&] { (void)parse(text); });
            CHECK(outcome.code == ErrorCode::InvalidFile);
            CHECK_MESSAGE(outcome.says(name), outcome.message);
        }
        if (c[0] != '\x01')
            CHECK(parse("Namespace(b='" + c + "', c=<" + c + ">, a=1) # " + c).getNumber("a", 0, "f") == 1);
    }
    CHECK(outcomeOf([] { (void)parse("Namespace(b=1,\u00a0a=1)"); }).says("U+00A0 at byte 14"));
}

TEST_CASE("settings: Python's truth is the trainers'")
{
    const ConfigValue config = parse("Namespace(a='False', b='', c=0.0, d=0.5, e=[], f=[0], g={}, h=True)");
    for (const char* yes : {"a", "d", "f", "h"})
        CHECK(config.getBool(yes, false, "f"));
    for (const char* no : {"b", "c", "e", "g"})
        CHECK_FALSE(config.getBool(no, true, "f"));
    CHECK(config.getNumber("h", 0, "f") == 1);
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
        REQUIRE((code == ErrorCode::Ok || code == ErrorCode::InvalidFile || code == ErrorCode::Unsupported));
    }
    CHECK(outcomeOf([] { (void)parse("Namespace(a=" + std::string(100000, '[') + ")"); }).code ==
          ErrorCode::InvalidFile);
    CHECK(outcomeOf([] { (void)parse("Namespace(a=1) b"); }).code == ErrorCode::InvalidFile);
}
