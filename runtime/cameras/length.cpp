// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/length.h"

#include <gsc/error.h>

#include "runtime/cameras/json_fields.h"

#include <nlohmann/json.hpp>

#include <charconv>

namespace gsc {

namespace {

constexpr double kTooLong = 1e15;
constexpr const char* kMetreSchema = "gsc.metre/1";

bool isLength(double value)
{
    return value > 0 && value < kTooLong; // also false for NaN
}

// Returns true if the text has control characters: C0, DEL or C1 (in UTF-8 from 0xc2 0x80 on). Programs print the rule
// of a metre, and these could disturb a terminal.
bool hasControl(const std::string& text)
{
    for (size_t i = 0; i < text.size(); ++i) {
        const auto c = uint8_t(text[i]);
        if (c < 0x20 || c == 0x7f || (c == 0xc2 && i + 1 < text.size() && uint8_t(text[i + 1]) < 0xa0))
            return true;
    }
    return false;
}

} // namespace

Length parseLength(const std::string& text, const char* option)
{
    double value = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    const std::string_view unit(rest, size_t(end - rest));
    Length length{value, unit.empty() ? LengthUnit::World : LengthUnit::Metre};
    if (unit == "cm")
        length.value /= 100;
    else if (unit == "mm")
        length.value /= 1000;
    const bool known = unit.empty() || unit == "m" || unit == "cm" || unit == "mm";
    if (error != std::errc() || !known || !isLength(length.value))
        throw Error(ErrorCode::Usage, formatString("%s %.40s", option, text.c_str()), "no length",
                    "a number above 0 in world units of the model such as 0.065, or one with m, cm or mm behind it "
                    "such as 64mm",
                    "correct it or leave it out");
    return length;
}

std::optional<Metre> metreOfManifest(std::string_view manifest)
{
    using Manifest = nlohmann::json;
    static const Manifest::json_pointer kUnits("/model/metre/units"), kRule("/model/metre/rule");
    const Manifest json = Manifest::parse(manifest, nullptr, false);
    if (!json.is_object() || !json.contains(kUnits) || !json.contains(kRule))
        return std::nullopt;
    const Manifest &units = json[kUnits], &rule = json[kRule];
    if (!units.is_number() || !isLength(units.get<double>()) || !rule.is_string())
        return std::nullopt;
    return Metre{units.get<double>(), rule.get<std::string>()};
}

Metre parseMetreFile(std::string_view text, const std::string& path)
{
    // parseJson() refuses a key that is there twice, which the library's parser does not
    const auto json = nlohmann::json::accept(text) ? parseJson(text, path, "a file of a metre") : ParsedJson();
    const auto refuse = [&](const char* found) {
        throw Error(ErrorCode::InvalidFile, path, found,
                    formatString("{\"schema\": \"%s\", \"units\": WORLD UNITS OF A METRE}", kMetreSchema),
                    "correct it, or delete it and have the metre derived");
    };
    if (!json.is_object() || !json.contains("schema") || json["schema"] != kMetreSchema)
        refuse("is no file of a metre");
    if (!json.contains("units") || !json["units"].is_number() || !isLength(json["units"].get<double>()))
        refuse("\"units\" is no length above 0");
    if (json.contains("rule") && !json["rule"].is_string())
        refuse("\"rule\" is no text");
    if (json.contains("rule") && hasControl(json["rule"].get<std::string>()))
        refuse("\"rule\" has a control character or a line end");
    return {json["units"].get<double>(), json.value("rule", "stated in metre.json beside the model")};
}

std::string metreFileText(const Metre& metre)
{
    const nlohmann::ordered_json json = {{"schema", kMetreSchema}, {"units", metre.units}, {"rule", metre.rule}};
    return json.dump(2) + "\n";
}

} // namespace gsc
