// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/verdict.h"

#include "convert/chart/run_words.h"
#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;
using Runs = std::vector<const ChartRun*>;

constexpr int kFloors[] = {50, 60, 70}; // dB

std::string msWords(double ms)
{
    return formatString("%.*f", ms >= 100 ? 0 : ms >= 10 ? 1 : ms >= 1 ? 2 : 3, ms);
}

// PSNR of the worst frame, dB; kBrokenPsnr if none was scored.
double worstOf(const ChartRun& run)
{
    return run.accuracy ? run.accuracy->psnr_min : kBrokenPsnr;
}

std::optional<size_t> fastestOf(const Runs& runs, double floor)
{
    std::optional<size_t> best;
    for (size_t i = 0; i < runs.size(); ++i)
        if (worstOf(*runs[i]) >= floor && (!best || runs[i]->ms.wall.median < runs[*best]->ms.wall.median))
            best = i;
    return best;
}

// PSNR floors in words, such as "50, 60 and 70 dB"; `last` joins the last.
std::string floorWords(const std::vector<int>& floors, const char* last)
{
    std::string text;
    for (size_t i = 0; i < floors.size(); ++i)
        text += formatString("%s%d", i == 0 ? "" : i + 1 == floors.size() ? last : ", ", floors[i]);
    return text + " dB";
}

std::string costWords(const ChartRun& run, const Json& row)
{
    std::string text = msWords(run.ms.wall.median) + " ms";
    if (run.rounds > 1)
        text += formatString(" (%s to %s in %llu repeats)", msWords(run.least_ms).c_str(), msWords(run.most_ms).c_str(),
                             static_cast<unsigned long long>(run.rounds));
    if (row["in_noise"].get<bool>())
        text += ", no difference from none: it lies within the scatter of the repeats";
    else if (!row["speedup"].is_null() && (run.config.reuse.policy != "none" || run.config.detail > 0))
        text += formatString(", %.2f times as fast as none", row["speedup"].get<double>());
    return text;
}

Json noneKeeps(const Runs& runs, const Json& rows, const std::vector<int>& floors)
{
    if (std::ranges::none_of(runs, [](const ChartRun* run) { return run->accuracy.has_value(); }))
        return {{"run", ""},
                {"text", "No run was scored against exact; gsc-play bench does so with --quality or --score-every."},
                {"options", ""}};
    const auto best = std::ranges::max_element(runs, {}, [](const ChartRun* run) { return worstOf(*run); });
    std::string text = "No run keeps " + floorWords(floors, " or ");
    if (worstOf(**best) > kBrokenPsnr)
        text += "; " + rows[size_t(best - runs.begin())]["name"].get<std::string>() +
                formatString(" comes nearest with %.1f dB", worstOf(**best));
    return {{"run", ""}, {"text", text + "."}, {"options", ""}};
}

} // namespace

Json verdictJson(const Runs& runs, const Json& rows)
{
    Json floors = Json::array(), sentences = Json::array();
    std::vector<std::pair<std::optional<size_t>, std::vector<int>>> kept; // one entry per run, fastest first
    for (const int floor : kFloors) {
        const std::optional<size_t> best = fastestOf(runs, floor);
        floors.push_back({{"psnr", floor}, {"row", best ? Json(*best) : Json(nullptr)}});
        if (kept.empty() || kept.back().first != best)
            kept.push_back({best, {}});
        kept.back().second.push_back(floor);
    }
    for (const auto& [best, reached] : kept)
        sentences.push_back(best ? Json{{"run", rows[*best]["name"]},
                                        {"text", " is the fastest that keeps " + floorWords(reached, " and ") + ": " +
                                                     costWords(*runs[*best], rows[*best]) + "."},
                                        {"options", optionsToType(runs[*best]->config)}}
                                 : noneKeeps(runs, rows, reached));
    return {{"floors", std::move(floors)}, {"sentences", std::move(sentences)}};
}

std::string baselineWords(const Json& panels)
{
    std::string titles;
    size_t count = 0;
    for (const Json& panel : panels)
        if (std::all_of(panel["rows"].begin(), panel["rows"].end(),
                        [](const Json& row) { return row["speedup"].is_null(); })) {
            titles += (count++ ? ", " : "") + panel["title"].get<std::string>();
        }
    if (count == 0)
        return {};
    return (count == panels.size() ? "No run" : titles + ": no run") +
           " has policy none and detail 0, so there is no speed-up to tell. Add {\"policy\": \"none\", \"detail\": 0} "
           "to the runs of the sweep, or a row of gsc-play bench without --reuse, --detail and --target-ms.";
}

} // namespace gsc
