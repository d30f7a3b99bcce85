// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/run_words.h"

#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

namespace gsc {

namespace {

std::string policyWords(const ReuseFacts& reuse)
{
    if (reuse.policy == "depth") {
        const std::string depth = reuse.max_depth < 0 ? "" : " " + std::to_string(reuse.max_depth);
        return "depth" + depth + (reuse.guidance.empty() ? "" : " " + reuse.guidance);
    }
    if (reuse.policy == "error" && reuse.bound >= 0)
        return formatString("error %g/255", reuse.bound);
    return reuse.policy;
}

std::string fileName(const FileFacts& file)
{
    return std::filesystem::path(file.path).filename().string();
}

// The number in words; empty if it is `none`.
std::string numberWords(const char* format, double value, double none = 0)
{
    return value != none ? formatString(format, value) : std::string();
}

} // namespace

std::string methodOf(const RowConfig& config)
{
    return config.detail > 0 ? "detail" : config.reuse.policy;
}

const FileFacts& comparedWith(const ChartRun& row)
{
    return row.reference_file ? *row.reference_file : row.file;
}

std::vector<std::string> sceneWords(const ChartRun& row)
{
    const RowConfig& config = row.config;
    const FileFacts& file = comparedWith(row);
    return {config.trajectory,
            fileName(file),
            row.backend,
            row.device.name,
            config.size[0] ? formatString("%ux%u", config.size[0], config.size[1]) : "the cameras' own size",
            config.eyes == 2 ? "2 eyes" : "1 eye",
            numberWords("eyes %g apart", config.ipd),
            numberWords("field of view %g degrees", config.fov_degrees),
            numberWords("near plane %g", config.near_z),
            numberWords("appearance %.0f", config.appearance, -1),
            formatCount(config.frames, "frame"),
            config.frames == config.shots ? std::string() : "round " + formatCount(config.shots, "camera"),
            config.warmup == 0 ? std::string()
            : config.cold      ? "times without the first " + formatCount(config.warmup)
                               : formatCount(config.warmup) + " before them as a warm-up",
            config.cameras,
            formatCount(file.anchors) + " anchors",
            formatBytes(file.bytes)};
}

std::vector<std::string> configWords(const ChartRun& row)
{
    const RowConfig& config = row.config;
    const ReuseFacts& reuse = config.reuse;
    return {
        policyWords(reuse),
        reuse.decode_budget ? "decode budget " + std::to_string(reuse.decode_budget) : std::string(),
        reuse.cache_budget ? "cache at most " + formatBytes(reuse.cache_budget) : std::string(),
        "tier " + config.tier + (row.rendered_tier == config.tier ? "" : " drawn as " + row.rendered_tier),
        numberWords("LOD bias %+g", config.lod_bias),
        numberWords("LOD fade %g", config.lod_fade),
        numberWords("LOD hysteresis %g", config.lod_hysteresis),
        numberWords("detail %g", config.detail),
        numberWords("target %g ms", config.target_ms),
        config.frames_in_flight > 1 ? formatCount(config.frames_in_flight) + " frames in flight" : std::string(),
        numberWords(config.fovea_pixels == 1 ? "foveation to %g pixel" : "foveation to %g pixels", config.fovea_pixels),
        row.service ? formatCount(row.service->list.size(), "worker") + ", mode " + row.service->mode : std::string(),
        config.stereo != "exact" ? "stereo " + config.stereo : std::string(),
        config.cold ? "cold start" : "warm start",
        config.threads ? formatCount(uint64_t(config.threads), "thread") : std::string(),
        config.vram_budget ? "VRAM at most " + formatBytes(config.vram_budget) : std::string(),
        row.reference_file ? "of " + fileName(row.file) : std::string(),
        row.label,
        toolWords(row)};
}

std::string optionsToType(const RowConfig& config)
{
    const ReuseFacts& reuse = config.reuse;
    const auto count = [](const char* option, uint64_t value) {
        return value > 0 ? formatString(" %s %llu", option, static_cast<unsigned long long>(value)) : std::string();
    };
    std::string text = "--tier " + config.tier;
    text += numberWords(" --detail %g", config.detail);
    if (reuse.policy != "none") {
        text += " --reuse " + reuse.policy;
        text += numberWords(" --reuse-depth %.0f", double(reuse.max_depth), -1);
        text += reuse.guidance.empty() ? "" : " --reuse-guidance " + reuse.guidance;
        text += numberWords(" --reuse-bound %g", reuse.bound, -1);
        text += count("--decode-budget", reuse.decode_budget) + count("--cache-budget", reuse.cache_budget);
    }
    text += numberWords(" --lod-bias %g", config.lod_bias) + numberWords(" --lod-fade %g", config.lod_fade) +
            numberWords(" --lod-hysteresis %g", config.lod_hysteresis);
    text += numberWords(" --target-ms %g", config.target_ms);
    if (config.fovea_pixels > 0)
        text += formatString(" --foveation fixed --fovea-pixels %g", config.fovea_pixels);
    if (config.eyes == 2)
        text += " --eyes 2" + (config.stereo == "exact" ? "" : " --stereo " + config.stereo);
    return text + count("--threads", uint64_t(config.threads)) + count("--vram-budget", config.vram_budget);
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

std::string toolWords(const ChartRun& row)
{
    return row.tool.name + " " + row.tool.version +
           (row.tool.commit.empty() ? "" : " (" + row.tool.commit.substr(0, 12) + ")");
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
