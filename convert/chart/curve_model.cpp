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

CurveJson detailsJson(const CurveFacts& curve) // milliseconds for each of kTimedDetails
{
    CurveJson list = CurveJson::array();
    for (const double ms : curve.detail_ms)
        list.push_back(rounded(ms));
    return list;
}

CurveJson pointJson(const RunRow& row)
{
    const CurveFacts& curve = *row.curve;
    const Accuracy& accuracy = *row.accuracy;
    const double anchors = double(std::max<uint64_t>(curve.model_anchors, 1));
    return {{"target", curve.target_psnr < 0 ? CurveJson() : rounded(curve.target_psnr)},
            {"anchors", row.file.anchors},
            {"archive", curve.archive_bytes},
            {"per_anchor", rounded(double(curve.archive_bytes) / anchors)},
            {"file", row.file.bytes},
            {"resident", row.peak_bytes},
            {"frame", rounded(row.ms.device.median)},
            {"decode", rounded(row.ms.stages[kDecodeStage].median)},
            {"detail", detailsJson(curve)},
            {"poses", row.config.shots},
            {"psnr", rounded(accuracy.psnr_pooled)},
            {"worst_psnr", rounded(accuracy.psnr_min)},
            {"worst", curve.worst_pose},
            {"ssim", rounded(accuracy.ssim.mean)},
            {"worst_ssim", rounded(accuracy.ssim.worst)},
            {"flip", rounded(accuracy.flip.mean)},
            {"worst_flip", rounded(accuracy.flip.worst)}};
}

// Names of the curves: name of the model, with anchors, device and pixels if several curves have one model.
std::vector<std::string> namesOf(const std::vector<ChartCurve>& curves)
{
    std::vector<std::string> names;
    for (const ChartCurve& curve : curves) {
        const RunRow& row = curve.rows.front();
        const bool twice = std::ranges::count_if(curves, [&](const ChartCurve& other) {
                               return other.rows.front().file.path == row.file.path;
                           }) > 1;
        names.push_back(twice ? formatString("%s, %s, %s, %s", row.file.path.c_str(),
                                             formatCount(row.curve->model_anchors, "anchor").c_str(),
                                             row.backend.c_str(), formatCount(row.curve->most_pixels, "pixel").c_str())
                              : row.file.path);
    }
    return names;
}

// Comparison of the smallest file of a curve with the model itself.
std::string verdictOf(const ChartCurve& curve, const std::string& name)
{
    const RunRow& first = curve.rows.front();
    const RunRow& least =
        *std::ranges::min_element(curve.rows, {}, [](const RunRow& row) { return row.curve->archive_bytes; });
    const double anchors = double(std::max<uint64_t>(first.curve->model_anchors, 1));
    std::string words =
        formatString("%s: %.4g bytes an anchor", name.c_str(), double(first.curve->archive_bytes) / anchors);
    if (&least != &first)
        words += formatString(", %.4g at %.4g dB", double(least.curve->archive_bytes) / anchors,
                              least.accuracy->psnr_pooled);
    return words;
}

template <typename Words>
std::string joined(const std::vector<ChartCurve>& curves, Words words)
{
    std::set<std::string> list;
    for (const ChartCurve& curve : curves)
        for (const RunRow& row : curve.rows)
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
        for (const RunRow& row : curves[i].rows)
            points.push_back(pointJson(row));
        list.push_back({{"name", names[i]}, {"points", std::move(points)}});
        verdict += (i > 0 ? "; " : "") + verdictOf(curves[i], names[i]);
    }
    const std::string devices =
        joined(curves, [](const RunRow& row) { return row.backend + ", tier " + row.config.tier; });
    const std::string words =
        "PSNR of poses that no bake looked from, against pictures of the whole model; drawn by " + devices;
    CurveJson facts = CurveJson::array();
    facts.push_back(CurveJson::array({"Models", joined(curves, [](const RunRow& row) {
                                          return row.file.path + ", " + formatCount(row.curve->model_anchors, "anchor");
                                      })}));
    facts.push_back(CurveJson::array({"Drawn by", devices}));
    facts.push_back(CurveJson::array(
        {"Measured with", joined(curves, [](const RunRow& row) { return row.tool.name + " " + row.tool.version; })}));
    CurveJson panels = CurveJson::array();
    panels.push_back({{"title", curves.size() == 1 ? names[0] : formatString("%zu models", curves.size())},
                      {"file_name", "curve"},
                      {"words", words},
                      {"verdict", verdict + "."},
                      {"curves", std::move(list)}});
    return {{"version", GSC_VERSION}, {"kind", "curve"}, {"facts", std::move(facts)}, {"panels", std::move(panels)}};
}

} // namespace gsc
