// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_words.h"

#include "format/error.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

namespace gsc {

namespace {

std::string policyWords(const RunConfig& config)
{
    if (config.policy == "depth") {
        std::string words = "depth";
        if (config.max_depth)
            words += formatString(" %llu", static_cast<unsigned long long>(*config.max_depth));
        return config.guidance.empty() ? words : words + " " + config.guidance;
    }
    if (config.policy == "error" && config.bound)
        return formatString("error %g/255", *config.bound);
    return config.policy;
}

std::string optionalWords(const char* format, const std::optional<double>& value)
{
    return value ? formatString(format, *value) : std::string();
}

} // namespace

std::vector<std::string> sceneWords(const RunRow& row)
{
    const RunConfig& config = row.config;
    return {config.trajectory,
            std::filesystem::path(row.file).filename().string(),
            row.backend,
            row.device,
            config.width ? formatString("%llux%llu", static_cast<unsigned long long>(*config.width),
                                        static_cast<unsigned long long>(config.height.value_or(0)))
                         : "the cameras' own size",
            config.eyes == 2 ? "2 eyes" : "1 eye",
            optionalWords("eyes %g apart", config.ipd),
            optionalWords("field of view %g degrees", config.fov_degrees),
            optionalWords("near plane %g", config.near_z),
            config.appearance ? "appearance " + std::to_string(*config.appearance) : std::string(),
            countWords(config.frames) + (config.frames == 1 ? " frame" : " frames"),
            config.warmup ? "times without the first " + countWords(config.warmup) : std::string(),
            config.cameras,
            countWords(row.anchors) + " anchors",
            byteWords(row.file_bytes)};
}

std::vector<std::string> configWords(const RunRow& row)
{
    const RunConfig& config = row.config;
    return {policyWords(config),
            config.decode_budget ? "decode budget " + std::to_string(*config.decode_budget) : std::string(),
            config.cache_budget ? "cache at most " + byteWords(*config.cache_budget) : std::string(),
            "tier " + config.tier + (row.rendered_tier == config.tier ? "" : " drawn as " + row.rendered_tier),
            config.lod_bias != 0 ? formatString("LOD bias %+g", config.lod_bias) : std::string(),
            config.lod_fade != 0 ? formatString("LOD fade %g", config.lod_fade) : std::string(),
            config.lod_hysteresis != 0 ? formatString("LOD hysteresis %g", config.lod_hysteresis) : std::string(),
            config.stereo != "exact" ? "stereo " + config.stereo : std::string(),
            config.cold ? "cold start" : "warm start",
            config.threads ? countWords(config.threads) + (config.threads == 1 ? " thread" : " threads")
                           : std::string(),
            config.vram_budget ? "VRAM at most " + byteWords(*config.vram_budget) : std::string(),
            row.label,
            toolWords(row)};
}

RunNames nameRuns(const std::vector<std::vector<std::string>>& words)
{
    RunNames names;
    names.own.resize(words.size());
    if (words.empty())
        return names;
    const auto append = [](std::string& text, const std::string& word) {
        if (!word.empty())
            text += (text.empty() ? "" : ", ") + word;
    };
    for (size_t k = 0; k < words[0].size(); ++k) {
        const bool shared =
            std::all_of(words.begin(), words.end(), [&](const auto& row) { return row[k] == words[0][k]; });
        if (shared && k > 0)
            append(names.common, words[0][k]);
        else
            for (size_t i = 0; i < words.size(); ++i)
                append(names.own[i], words[i][k]);
    }
    std::set<std::string> used;
    std::map<std::string, size_t> copies;
    for (std::string& name : names.own) {
        const std::string plain = name;
        while (!used.insert(name).second) {
            size_t& copy = copies[plain];
            copy = std::max<size_t>(copy, 1) + 1;
            name = formatString("%s (%zu)", plain.c_str(), copy);
        }
    }
    return names;
}

std::string countWords(uint64_t count)
{
    std::string text = std::to_string(count);
    for (size_t i = text.size(); i > 3; i -= 3)
        text.insert(i - 3, 1, ',');
    return text;
}

std::string byteWords(uint64_t bytes)
{
    static const char* const kUnits[] = {"KiB", "MiB", "GiB", "TiB"};
    if (bytes < 1024)
        return countWords(bytes) + " B";
    double value = double(bytes) / 1024;
    size_t unit = 0;
    for (; value >= 1024 && unit + 1 < std::size(kUnits); ++unit)
        value /= 1024;
    return formatString("%.3g %s", value, kUnits[unit]);
}

std::string toolWords(const RunRow& row)
{
    return row.tool + " " + row.version + (row.commit.empty() ? "" : " (" + row.commit.substr(0, 12) + ")");
}

std::string fileNameOf(const std::string& title)
{
    constexpr size_t kLongest = 60;
    std::string name;
    for (const char c : title) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        if (plain)
            name += c;
        else if (!name.empty() && name.back() != '-')
            name += '-';
    }
    name.resize(std::min(name.size(), kLongest));
    while (!name.empty() && name.back() == '-')
        name.pop_back();
    return name.empty() ? "run" : name;
}

} // namespace gsc
