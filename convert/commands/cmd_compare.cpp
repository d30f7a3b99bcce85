// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"
#include "convert/commands/command.h"
#include "convert/compare/compare_render.h"

#include "convert/compare/compare_checkpoint.h"
#include "runtime/frame_stats.h"

#include <cmath>
#include <functional>
#include <optional>

namespace gsc {

namespace {

constexpr uint64_t kMaxViews = 1'000'000;

struct CompareOptions {
    std::string checkpoint_path;
    std::string file;
    CheckpointOptions checkpoint;
    bool render = false;
    RenderOptions rendering;
};

struct Comparison {
    CompareReport values;
    std::optional<RenderComparison> pictures;
    bool pass = false;
};

Json viewsJson(const std::vector<RenderedView>& views)
{
    Json json = Json::array();
    for (const RenderedView& view : views)
        json.push_back({{"name", view.name},
                        {"width", view.width},
                        {"height", view.height},
                        {"picture_bits", view.picture_bits ? Json(view.picture_bits) : Json(nullptr)},
                        {"psnr", jsonNumber(view.difference.psnr)},
                        {"max_error", jsonNumber(view.difference.max_error)},
                        {"max_at", {view.difference.max_x, view.difference.max_y}},
                        {"pixels_over_1_255", view.difference.over_1_255},
                        {"ssim", jsonNumber(view.ssim)},
                        {"flip", jsonNumber(view.flip)}});
    return json;
}

Json pictureSetJson(const PictureSet& pictures)
{
    if (pictures.views.empty())
        return nullptr;
    const PooledDifference& pool = pictures.pool;
    return {{"psnr", jsonNumber(pool.psnr())}, // null = no difference at all
            {"worst_psnr", jsonNumber(pool.worst_psnr)},
            {"worst_view", pictures.views[size_t(pool.worst_frame)].name},
            {"max_error", jsonNumber(pool.max_error)},
            {"views", viewsJson(pictures.views)}};
}

Json compareJson(const CompareOptions& options, const Comparison& comparison, double seconds)
{
    Json attributes = Json::array();
    for (const AttributeDifference& attribute : comparison.values.attributes)
        attributes.push_back({{"name", attribute.name},
                              {"compared", attribute.compared},
                              {"different", attribute.different},
                              {"max_abs", jsonNumber(attribute.max_abs)},
                              {"first", attribute.different ? Json(attribute.first) : Json(nullptr)}});
    Json json = {{"schema", "gsc.compare/1"},
                 {"checkpoint", options.checkpoint_path},
                 {"file", options.file},
                 {"pass", comparison.pass},
                 {"equal", comparison.values.equal},
                 {"anchors", comparison.values.anchors},
                 {"dropped", comparison.values.dropped},
                 {"attributes", std::move(attributes)},
                 {"problems", comparison.values.problems}};
    if (comparison.pictures)
        json["render"] = {{"tier", tierName(comparison.pictures->tier)},
                          {"min_psnr", options.rendering.min_psnr},
                          {"precision", options.rendering.reference == ReferencePrecision::Float ? "float" : "double"},
                          {"reference", pictureSetJson(comparison.pictures->reference)},
                          {"trainer", pictureSetJson(comparison.pictures->trainer)}};
    else
        json["render"] = nullptr;
    json["seconds"] = jsonNumber(seconds);
    json["peak_memory_bytes"] = peakMemoryBytes();
    return json;
}

std::string decibels(double psnr)
{
    return std::isfinite(psnr) ? formatString("%.2f dB", psnr) : "equal";
}

std::string picturesText(const char* title, const PictureSet& pictures)
{
    if (pictures.views.empty())
        return formatString("%-24s none\n", title);
    const PooledDifference& pool = pictures.pool;
    std::string text = formatString("%-24s pooled %s, worst %s (%s), max error %.3g\n", title,
                                    decibels(pool.psnr()).c_str(), decibels(pool.worst_psnr).c_str(),
                                    pictures.views[size_t(pool.worst_frame)].name.c_str(), pool.max_error);
    for (const RenderedView& view : pictures.views)
        text += formatString("  %-22s %s, max error %.3g, SSIM %.6f, FLIP %.6f%s\n", view.name.c_str(),
                             decibels(view.difference.psnr).c_str(), view.difference.max_error, view.ssim, view.flip,
                             view.picture_bits == 8 ? ", beyond the rounding of an 8-bit picture" : "");
    return text;
}

std::string compareText(const Comparison& comparison)
{
    std::string text;
    for (const AttributeDifference& attribute : comparison.values.attributes) {
        text += formatString("%-24s %s values, ", attribute.name.c_str(), formatCount(attribute.compared).c_str());
        text += attribute.different
                    ? formatString("%s different, max %.9g, first at %s\n", formatCount(attribute.different).c_str(),
                                   attribute.max_abs, formatCount(attribute.first).c_str())
                    : "equal\n";
    }
    for (const std::string& problem : comparison.values.problems)
        text += "different: " + problem + "\n";
    if (comparison.values.dropped)
        text += formatString("%s anchors were left out on purpose (--drop-invalid)\n",
                             formatCount(comparison.values.dropped).c_str());
    text += formatString("%s anchors: %s\n", formatCount(comparison.values.anchors).c_str(),
                         comparison.values.summary().c_str());
    if (comparison.pictures) {
        text += picturesText("pictures, reference", comparison.pictures->reference);
        text += picturesText("pictures, trainer's own", comparison.pictures->trainer);
    }
    return text;
}

ErrorCode runCompare(const CompareOptions& options, Reporter& report)
{
    const Checkpoint checkpoint = readCheckpoint(options.checkpoint_path, options.checkpoint);
    for (const std::string& warning : checkpoint.warnings)
        report.warning(warning);
    Comparison comparison;
    comparison.values = compareCheckpoint(checkpoint, options.file, std::bind_front(&Reporter::progress, &report));
    report.endProgress(false);
    comparison.pass = comparison.values.equal;
    if (options.render) {
        comparison.pictures = compareRenders(checkpoint, options.file, options.rendering, report);
        comparison.pass = comparison.pass && comparison.pictures->passes(options.rendering.min_psnr);
    }
    if (report.json())
        report.object(compareJson(options, comparison, report.seconds()));
    else
        report.text(compareText(comparison));
    report.done(comparison.pass ? "no difference found" : "difference found");
    return comparison.pass ? ErrorCode::Ok : ErrorCode::Difference;
}

void addRenderOptions(CLI::App& command, CompareOptions& options)
{
    const Heading heading(command, "Pictures");
    OptionHandle render =
        addFlag(command, "--render", options.render, "compare pictures too: the file's against the checkpoint's");
    RenderOptions& rendering = options.rendering;
    const auto add = [&](OptionHandle option) { option.needs(render); };
    add(addText(command, "--golden", rendering.golden, "DIR",
                "the trainer's own pictures: NAME.png and cameras.json (default: golden or test/ours_N/renders of the "
                "model folder, where they are)"));
    add(addText(command, "--cameras", rendering.cameras, "FILE.json|stored (default: stored)",
                "camera file, or those stored in FILE"));
    add(addFlag(command, "--ignore-distortion", rendering.ignore_distortion,
                "draw cameras that state lens distortion as pinholes instead of refusing them"));
    add(addCount(command, "--views", rendering.views, 0, kMaxViews, "N (default: 3)",
                 "cameras drawn against the reference, evenly spaced; 0 = all"));
    add(addNumber(command, "--min-psnr", rendering.min_psnr, {0, 1000}, " dB", "DB (default: 75)",
                  "a view below it is a difference"));
    add(addChoice<Tier>(command, "--tier", rendering.tier, {{"exact", Tier::Exact}, {"fast", Tier::Fast}},
                        "default: exact", "how FILE is rendered; the CPU renders fast as exact"));
    add(addChoice<ReferencePrecision>(command, "--reference", rendering.reference,
                                      {{"float", ReferencePrecision::Float}, {"double", ReferencePrecision::Double}},
                                      "default: float",
                                      "arithmetic of the reference: float rounds as the trainer does"));
    add(addInteger(command, "-j,--threads", rendering.threads, 0, 4096, "N (default: 0)", "threads, 0 = all cores"));
}

} // namespace

void addCompareCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<CompareOptions>();
    CLI::App& command =
        addCommand(app, "compare", "Compare a .gsc file with the checkpoint it was made from, value for value");
    addText(command, "CHECKPOINT", options->checkpoint_path, "MODEL|FILE.ply", "model folder, iteration folder or PLY")
        .required();
    addText(command, "FILE", options->file, "FILE.gsc", "the .gsc file").required();
    addRenderOptions(command, *options);
    addCheckpointOptions(command, options->checkpoint);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command,
              "Every attribute of every anchor, every weight and every camera is compared bit for bit. Exits with\n"
              "8 if anything differs or a view is below --min-psnr.\n\n"
              "examples:\n"
              "  gsc compare output/city city.gsc\n"
              "  gsc compare output/city city.gsc --render --views 5 --format json");
    onParsed(command, invocation, options, runCompare);
}

} // namespace gsc
