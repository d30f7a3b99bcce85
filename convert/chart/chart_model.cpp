// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_model.h"

#include "convert/chart/pareto.h"
#include "convert/chart/rounded.h"
#include "convert/chart/run_words.h"
#include "convert/chart/verdict.h"
#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;

template <typename Number>
Json roundedSeries(const std::vector<Number>& values)
{
    Json list = Json::array();
    for (const Number value : values)
        list.push_back(rounded(double(value)));
    return list;
}

struct Panel {
    std::vector<std::string> scene;
    std::vector<const ChartRun*> rows;
};

std::vector<Panel> panelsOf(const std::vector<ChartRun>& rows)
{
    std::vector<Panel> panels;
    std::map<std::vector<std::string>, size_t> known;
    for (const ChartRun& row : rows) {
        std::vector<std::string> scene = sceneWords(row);
        std::vector<std::string> key = scene;
        key.push_back(comparedWith(row).path); // the words have only the last part of the path
        const auto [found, is_new] = known.emplace(std::move(key), panels.size());
        if (is_new)
            panels.push_back({std::move(scene), {}});
        panels[found->second].rows.push_back(&row);
    }
    return panels;
}

// Likeness of two runs in settings that a speed-up should not come from, most important first; higher is more alike.
unsigned likeness(const ChartRun& none, const ChartRun& row)
{
    const bool alike[] = {none.label == row.label,
                          none.tool == row.tool,
                          none.config.cold == row.config.cold,
                          none.config.stereo == "exact",
                          none.config.fovea_pixels == 0,
                          none.config.lod_bias == 0 && none.config.lod_fade == 0 && none.config.lod_hysteresis == 0};
    unsigned value = 0;
    for (const bool bit : alike)
        value = value * 2 + bit;
    return value;
}

// How many devices draw, and how they share.
std::pair<size_t, std::string> workersOf(const ChartRun& row)
{
    return row.service ? std::pair(row.service->list.size(), row.service->mode) : std::pair(size_t(0), std::string());
}

const ChartRun* baselineOf(const Panel& panel, const ChartRun& row)
{
    const ChartRun* best = nullptr;
    for (const ChartRun* none : panel.rows) {
        const bool fits = methodOf(none->config) == "none" && none->config.target_ms == 0 && !none->reference_file &&
                          none->config.frames_in_flight == row.config.frames_in_flight &&
                          workersOf(*none) == workersOf(row) && none->config.tier == row.config.tier &&
                          none->config.threads == row.config.threads &&
                          none->config.vram_budget == row.config.vram_budget;
        if (fits && (!best || likeness(*none, row) > likeness(*best, row)))
            best = none;
    }
    return best;
}

Json repeatsJson(const ChartRun& row)
{
    if (row.rounds < 2)
        return nullptr;
    return {{"count", row.rounds}, {"min", rounded(row.least_ms)}, {"max", rounded(row.most_ms)}};
}

Json foveaJson(const std::optional<FoveaAccuracy>& fovea)
{
    if (!fovea)
        return nullptr;
    const auto partJson = [](const FoveaAccuracy::Part& part) {
        return part.share == 0 ? Json(nullptr)
                               : Json{{"pooled", rounded(part.psnr_pooled)},
                                      {"min", rounded(part.psnr_min)},
                                      {"flip", part.flip < 0 ? Json() : rounded(part.flip)}};
    };
    return {{"inside", partJson(fovea->inside)}, {"outside", partJson(fovea->outside)}};
}

Json accuracyJson(const Accuracy& accuracy)
{
    return {{"pooled", rounded(accuracy.psnr_pooled)},
            {"p1", rounded(accuracy.psnr_p1)},
            {"min", rounded(accuracy.psnr_min)},
            {"max_error", rounded(accuracy.max_error)},
            {"temporal_max", accuracy.temporal.images ? rounded(accuracy.temporal.max) : Json()},
            {"ssim", accuracy.ssim.frames ? rounded(accuracy.ssim.mean) : Json()},
            {"flip", accuracy.flip.frames ? rounded(accuracy.flip.mean) : Json()},
            {"fovea", foveaJson(accuracy.fovea)}};
}

// Values of single frames. The scored frames are in `listed`, or every `every_scored`-th from `first_scored` on.
Json framesJson(const ChartRun& row, const Accuracy& accuracy)
{
    return {{"first_scored", accuracy.scored.first},      {"every_scored", accuracy.scored.every},
            {"listed", accuracy.scored.listed},           {"wall", roundedSeries(row.wall_ms)},
            {"psnr", roundedSeries(accuracy.frame_psnr)}, {"temporal", roundedSeries(accuracy.frame_temporal)},
            {"decoded", roundedSeries(row.decoded)}};
}

Json rowJson(const ChartRun& row, const std::string& name, const ChartRun* baseline)
{
    const Accuracy accuracy = row.accuracy.value_or(Accuracy());
    const bool overlaps = baseline && baseline != &row && baseline->rounds * row.rounds > 1 &&
                          row.least_ms <= baseline->most_ms && baseline->least_ms <= row.most_ms;
    Json json = {{"name", name},
                 {"method", methodOf(row.config)},
                 {"baseline", false},
                 {"ms",
                  {{"mean", rounded(row.ms.wall.mean)},
                   {"median", rounded(row.ms.wall.median)},
                   {"p95", rounded(row.ms.wall.p95)},
                   {"p99", rounded(row.ms.wall.p99)},
                   {"max", rounded(row.ms.wall.max)}}},
                 {"repeats", repeatsJson(row)},
                 {"device_ms", rounded(row.ms.device.median)},
                 {"decode_ms", rounded(row.ms.stages[kDecodeStage].median)},
                 {"speedup", baseline ? rounded(baseline->ms.wall.median / row.ms.wall.median) : Json(nullptr)},
                 {"in_noise", overlaps},
                 {"scored", row.accuracy.has_value()}};
    json.update(accuracyJson(accuracy));
    json.update({{"decoded", rounded(row.reuse.decoded.mean)},
                 {"hit_rate", rounded(row.reuse.hit_rate)},
                 {"cache_bytes", row.reuse.cache_bytes},
                 {"peak_bytes", row.peak_bytes},
                 {"frames", framesJson(row, accuracy)}});
    return json;
}

std::vector<size_t> frontOf(const Panel& panel, double Accuracy::*psnr, const std::vector<size_t>& members)
{
    std::vector<SpeedAccuracy> points;
    std::vector<size_t> sound; // rows without a broken image: speed alone is no merit
    for (const size_t i : members) {
        const std::optional<Accuracy>& accuracy = panel.rows[i]->accuracy;
        if (!accuracy || !((*accuracy).*psnr > kBrokenPsnr))
            continue;
        sound.push_back(i);
        points.push_back({panel.rows[i]->ms.wall.median, (*accuracy).*psnr});
    }
    std::vector<size_t> front;
    for (const size_t i : paretoFront(points))
        front.push_back(sound[i]);
    return front;
}

// At most kMaxShown rows: baselines, front, and the best of every method without a row among these.
std::vector<size_t> shownOf(const Panel& panel, double Accuracy::*psnr, const std::vector<size_t>& front,
                            const std::set<size_t>& baselines)
{
    std::vector<size_t> few = thinned({baselines.begin(), baselines.end()}, kMaxShown / 2);
    std::set<size_t> shown(few.begin(), few.end());
    const auto addSpread = [&](const std::vector<size_t>& from, size_t count) {
        std::vector<size_t> rest;
        std::copy_if(from.begin(), from.end(), std::back_inserter(rest), [&](size_t i) { return !shown.count(i); });
        const std::vector<size_t> spread = thinned(rest, std::min(count, kMaxShown - shown.size()));
        shown.insert(spread.begin(), spread.end());
    };
    addSpread(front, kMaxShown);
    std::map<std::string, std::vector<size_t>> absent;
    for (size_t i = 0; i < panel.rows.size(); ++i)
        absent[methodOf(panel.rows[i]->config)].push_back(i);
    for (const size_t i : shown)
        absent.erase(methodOf(panel.rows[i]->config));
    const size_t share = absent.empty() ? 0 : (kMaxShown - shown.size()) / absent.size();
    for (const auto& [method, members] : absent)
        addSpread(frontOf(panel, psnr, members), std::max<size_t>(share, 1));
    return {shown.begin(), shown.end()};
}

Json viewJson(const Panel& panel, double Accuracy::*psnr, const std::set<size_t>& baselines)
{
    std::vector<size_t> all(panel.rows.size());
    std::iota(all.begin(), all.end(), size_t(0));
    const std::vector<size_t> front = frontOf(panel, psnr, all);
    std::vector<size_t> shown = all.size() <= kMaxShown ? all : shownOf(panel, psnr, front, baselines);
    std::stable_sort(shown.begin(), shown.end(),
                     [&](size_t a, size_t b) { return panel.rows[a]->ms.wall.median < panel.rows[b]->ms.wall.median; });
    return {{"front", front}, {"shown", shown}};
}

Json panelJson(const Panel& panel, const std::string& title, const std::string& file_name)
{
    std::vector<std::vector<std::string>> words;
    for (const ChartRun* row : panel.rows)
        words.push_back(configWords(*row));
    const RunNames names = nameRuns(words);

    Json rows = Json::array();
    std::set<size_t> baselines;
    for (size_t i = 0; i < panel.rows.size(); ++i) {
        const ChartRun* baseline = baselineOf(panel, *panel.rows[i]);
        rows.push_back(rowJson(*panel.rows[i], names.own[i], baseline));
        if (baseline)
            baselines.insert(size_t(std::find(panel.rows.begin(), panel.rows.end(), baseline) - panel.rows.begin()));
    }
    for (const size_t i : baselines)
        rows[i]["baseline"] = true;

    std::string facts;
    for (size_t i = 1; i < panel.scene.size(); ++i)
        if (!panel.scene[i].empty())
            facts += (facts.empty() ? "" : ", ") + panel.scene[i];
    if (!names.common.empty())
        facts += "; every run: " + names.common;
    Json verdict = verdictJson(panel.rows, rows);
    return {{"title", title},
            {"file_name", file_name},
            {"words", facts},
            {"verdict", std::move(verdict)},
            {"rows", std::move(rows)},
            {"views",
             {{"min", viewJson(panel, &Accuracy::psnr_min, baselines)},
              {"pooled", viewJson(panel, &Accuracy::psnr_pooled, baselines)}}}};
}

// Keys that are equal in all panels for equal settings: words, then a number that tells rows with equal words apart. The
// words leave out the number of a decode budget, because "match" gives another on every path.
std::vector<std::vector<std::string>> styleKeys(const Panel& panel)
{
    std::map<std::vector<std::string>, size_t> seen;
    std::vector<std::vector<std::string>> keys;
    for (const ChartRun* row : panel.rows) {
        std::vector<std::string> key = configWords(*row);
        constexpr size_t kDecodeBudget = 1;
        if (!key[kDecodeBudget].empty())
            key[kDecodeBudget] = "decode budget";
        const size_t copy = seen[key]++;
        key.push_back(std::to_string(copy));
        keys.push_back(std::move(key));
    }
    return keys;
}

// Gives every method a hue, and every shown configuration of a method a shade and a dash, in the order of the input.
void addStyles(const std::vector<Panel>& panels, Json& list)
{
    const auto placeOf = [](const auto& all, const auto& one) {
        return size_t(std::find(all.begin(), all.end(), one) - all.begin());
    };
    std::vector<std::string> methods = {"none", "depth", "error", "detail"};
    std::vector<std::vector<std::vector<std::string>>> keys;
    std::map<std::string, std::vector<std::vector<std::string>>> shown;
    for (size_t k = 0; k < panels.size(); ++k) {
        keys.push_back(styleKeys(panels[k]));
        std::set<size_t> here;
        for (const Json& view : list[k]["views"])
            for (const Json& row : view["shown"])
                here.insert(row.get<size_t>());
        for (const size_t i : here) {
            auto& known = shown[methodOf(panels[k].rows[i]->config)];
            if (placeOf(known, keys[k][i]) == known.size())
                known.push_back(keys[k][i]);
        }
    }
    for (size_t k = 0; k < panels.size(); ++k)
        for (size_t i = 0; i < panels[k].rows.size(); ++i) {
            const std::string method = methodOf(panels[k].rows[i]->config);
            const size_t hue = placeOf(methods, method);
            if (hue == methods.size())
                methods.push_back(method);
            const auto& known = shown[method];
            const size_t place = placeOf(known, keys[k][i]);
            const bool graded = known.size() > 1 && place < known.size();
            Json& row = list[k]["rows"][i];
            row["hue"] = hue;
            row["shade"] = rounded(graded ? double(place) / double(known.size() - 1) : 0.5);
            row["dash"] = place % 3;
        }
}

// Titles of panels: the trajectory, with the words in which panels of one trajectory differ.
std::vector<std::string> titlesOf(const std::vector<Panel>& panels)
{
    std::map<std::string, std::vector<size_t>> same;
    for (size_t i = 0; i < panels.size(); ++i)
        same[panels[i].scene[0]].push_back(i);
    std::vector<std::string> titles(panels.size());
    for (const auto& [trajectory, members] : same) {
        std::vector<std::vector<std::string>> words;
        for (const size_t i : members)
            words.push_back(panels[i].scene);
        const RunNames names = nameRuns(words);
        for (size_t k = 0; k < members.size(); ++k)
            titles[members[k]] = names.own[k];
    }
    return titles;
}

Json factsJson(const std::vector<ChartRun>& rows, size_t panels)
{
    Json facts = Json::array();
    const auto add = [&](const char* name, const auto& wordsOf) {
        std::vector<std::string> different;
        for (const ChartRun& row : rows) {
            const std::string words = wordsOf(row);
            if (!words.empty() && std::find(different.begin(), different.end(), words) == different.end())
                different.push_back(words);
        }
        constexpr size_t kMost = 6;
        std::string text;
        for (size_t i = 0; i < std::min(different.size(), kMost); ++i)
            text += (i ? "; " : "") + different[i];
        if (different.size() > kMost)
            text += formatString("; %zu more", different.size() - kMost);
        if (!text.empty())
            facts.push_back({name, text});
    };
    add("Model", [](const ChartRun& row) {
        return row.file.path + ", " + formatCount(row.file.anchors) + " anchors, " + formatBytes(row.file.bytes);
    });
    add("Device", [](const ChartRun& row) {
        return (row.device.name.empty() ? "unknown" : row.device.name) +
               (row.device.driver.empty() ? "" : ", driver " + row.device.driver) +
               (row.device.memory_bytes ? ", " + formatBytes(row.device.memory_bytes) : "");
    });
    add("Backend", [](const ChartRun& row) { return row.backend; });
    add("Reference", [](const ChartRun& row) {
        return row.reference.empty() ? std::string() : "tier exact without reuse, by backend " + row.reference;
    });
    add("Images", [](const ChartRun& row) {
        const std::vector<std::string> words = sceneWords(row);
        constexpr size_t kSize = 4, kEyes = 5;
        return words[kSize] + ", " + words[kEyes];
    });
    add("Measured with", [](const ChartRun& row) { return toolWords(row); });
    add("Label", [](const ChartRun& row) { return row.label; });
    facts.push_back({"Runs", formatCount(rows.size()) + " in " + formatCount(panels, "comparison")});
    return facts;
}

} // namespace

Json chartModel(const std::vector<ChartRun>& rows)
{
    const std::vector<Panel> panels = panelsOf(rows);
    const std::vector<std::string> titles = titlesOf(panels);
    Json list = Json::array();
    std::set<std::string> file_names;
    for (size_t i = 0; i < panels.size(); ++i) {
        const std::string plain = fileNameOf(titles[i]);
        std::string name = plain;
        for (size_t copy = 2; !file_names.insert(name).second; ++copy)
            name = plain + "-" + std::to_string(copy);
        list.push_back(panelJson(panels[i], titles[i], name));
    }
    addStyles(panels, list);
    return {{"version", GSC_VERSION},
            {"facts", factsJson(rows, panels.size())},
            {"no_baseline", baselineWords(list)},
            {"panels", std::move(list)}};
}

} // namespace gsc
