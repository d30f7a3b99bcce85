// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/curve_model.h"

#include "convert/chart/rounded.h"
#include <gsc/error.h>
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <set>

namespace gsc {

namespace {

using CurveJson = nlohmann::ordered_json;

// One for each of kTimedDetails; null where it is not told.
CurveJson detailsJson(const CurveRow& row)
{
    if (row.detail_ms.empty())
        return nullptr;
    CurveJson list = CurveJson::array();
    for (const double ms : row.detail_ms)
        list.push_back(rounded(ms));
    return list;
}

CurveJson pointJson(const CurveRow& row)
{
    const double anchors = double(std::max<uint64_t>(row.model_anchors, 1));
    return {{"target", row.target_psnr < 0 ? CurveJson() : rounded(row.target_psnr)},
            {"anchors", row.anchors},
            {"archive", row.archive_bytes},
            {"per_anchor", rounded(double(row.archive_bytes) / anchors)},
            {"file", row.bytes},
            {"resident", row.resident_bytes},
            {"frame", rounded(row.frame_ms)},
            {"decode", rounded(row.decode_ms)},
            {"detail", detailsJson(row)},
            {"poses", row.poses},
            {"psnr", rounded(row.psnr)},
            {"worst_psnr", rounded(row.worst_psnr)},
            {"worst", row.worst},
            {"ssim", rounded(row.ssim)},
            {"worst_ssim", rounded(row.worst_ssim)},
            {"flip", rounded(row.flip)},
            {"worst_flip", rounded(row.worst_flip)}};
}

// Names of the curves: the model's, and where several have one model its anchors, device and pixels too.
std::vector<std::string> namesOf(const std::vector<ChartCurve>& curves)
{
    std::vector<std::string> names;
    for (const ChartCurve& curve : curves) {
        const CurveRow& row = curve.rows.front();
        const bool twice = std::ranges::count_if(curves, [&](const ChartCurve& other) {
                               return other.rows.front().model == row.model;
                           }) > 1;
        names.push_back(twice ? formatString("%s, %s anchors, %s, %s pixels", row.model.c_str(),
                                             formatCount(row.model_anchors).c_str(), row.device.c_str(),
                                             formatCount(row.most_pixels).c_str())
                              : row.model);
    }
    return names;
}

// The smallest of a curve beside the model itself.
std::string verdictOf(const ChartCurve& curve, const std::string& name)
{
    const CurveRow& first = curve.rows.front();
    const CurveRow& least = *std::ranges::min_element(curve.rows, {}, &CurveRow::archive_bytes);
    const double anchors = double(std::max<uint64_t>(first.model_anchors, 1));
    std::string words = formatString("%s: %.4g bytes an anchor", name.c_str(), double(first.archive_bytes) / anchors);
    if (&least != &first)
        words += formatString(", %.4g at %.4g dB", double(least.archive_bytes) / anchors, least.psnr);
    return words;
}

template <typename Words>
std::string joined(const std::vector<ChartCurve>& curves, Words words)
{
    std::set<std::string> list;
    for (const ChartCurve& curve : curves)
        for (const CurveRow& row : curve.rows)
            list.insert(words(row));
    std::string text;
    for (const std::string& one : list)
        text += (text.empty() ? "" : "; ") + one;
    return text;
}

} // namespace

CurveJson curveModel(const std::vector<ChartCurve>& curves)
{
    const std::vector<std::string> names = namesOf(curves);
    CurveJson list = CurveJson::array();
    std::string verdict;
    for (size_t i = 0; i < curves.size(); ++i) {
        CurveJson points = CurveJson::array();
        for (const CurveRow& row : curves[i].rows)
            points.push_back(pointJson(row));
        list.push_back({{"name", names[i]}, {"points", std::move(points)}});
        verdict += (i > 0 ? "; " : "") + verdictOf(curves[i], names[i]);
    }
    const std::string devices = joined(curves, [](const CurveRow& row) { return row.device + ", tier " + row.tier; });
    const std::string words =
        "PSNR of poses that no bake looked from, against pictures of the whole model; drawn by " + devices;
    CurveJson facts = CurveJson::array();
    facts.push_back(CurveJson::array({"Models", joined(curves, [](const CurveRow& row) {
                                          return row.model + ", " + formatCount(row.model_anchors) + " anchors";
                                      })}));
    facts.push_back(CurveJson::array({"Drawn by", devices}));
    facts.push_back(CurveJson::array(
        {"Measured with", joined(curves, [](const CurveRow& row) { return row.tool.name + " " + row.tool.version; })}));
    CurveJson panels = CurveJson::array();
    panels.push_back({{"title", curves.size() == 1 ? names[0] : formatString("%zu models", curves.size())},
                      {"file_name", "curve"},
                      {"words", words},
                      {"verdict", verdict + "."},
                      {"curves", std::move(list)}});
    return {{"version", GSC_VERSION}, {"kind", "curve"}, {"facts", std::move(facts)}, {"panels", std::move(panels)}};
}

} // namespace gsc
