// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"
#include "convert/commands/command.h"
#include "convert/commands/model_facts.h"
#include "convert/compare/compare_render.h"

#include "convert/compare/compare_checkpoint.h"
#include <gsc/frame_stats.h>

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

    [[nodiscard]] bool isBaked() const { return !values.reduction.empty(); }
    [[nodiscard]] Json reduction() const { return isBaked() ? Json::parse(values.reduction) : Json(nullptr); }
};

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
                 {"reduction", comparison.reduction()},
                 {"attributes", std::move(attributes)},
                 {"problems", comparison.values.problems}};
    if (comparison.pictures)
        json["render"] = {{"tier", tierName(comparison.pictures->tier)},
                          {"min_psnr", options.rendering.min_psnr},
                          {"precision", options.rendering.reference == ReferencePrecision::Float ? "float" : "double"},
                          {"reference", pictureSetJson(comparison.pictures->reference)},
                          {"trainer", pictureSetJson(comparison.pictures->trainer)},
                          {"lpips_missing", comparison.pictures->lpips_missing.empty()
                                                ? Json(nullptr)
                                                : Json(comparison.pictures->lpips_missing)}};
    else
        json["render"] = nullptr;
    json["seconds"] = jsonNumber(seconds);
    json["peak_memory_bytes"] = peakMemoryBytes();
    return json;
}

std::string compareText(const Comparison& comparison)
{
    std::string text;
    for (const AttributeDifference& attribute : comparison.values.attributes) {
        text += formatString("%-24s %s, ", attribute.name.c_str(), formatCount(attribute.compared, "value").c_str());
        text += attribute.different
                    ? formatString("%s different, max %.9g, first at %s\n", formatCount(attribute.different).c_str(),
                                   attribute.max_abs, formatCount(attribute.first).c_str())
                    : "equal\n";
    }
    for (const std::string& problem : comparison.values.problems)
        text += "different: " + problem + "\n";
    if (comparison.values.dropped)
        text += formatString("%s left out on purpose (--drop-invalid)\n",
                             formatCount(comparison.values.dropped, "anchor").c_str());
    if (comparison.isBaked())
        text += "baked " + bakedText(comparison.reduction()) +
                (comparison.values.equal ? "\n" : "; so values differ on purpose: --render compares pictures\n");
    text += formatString("%s: %s\n", formatCount(comparison.values.anchors, "anchor").c_str(),
                         comparison.values.summary().c_str());
    if (comparison.pictures) {
        text += pictureSetText("pictures, reference", comparison.pictures->reference);
        text += pictureSetText("pictures, trainer's own", comparison.pictures->trainer);
        if (!comparison.pictures->lpips_missing.empty())
            text += comparison.pictures->lpips_missing + '\n';
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
                "folder of the trainer's own pictures, NAME.png, and their cameras.json (default: golden or "
                "test/ours_N/renders of the model folder, if it is there)")
            .rare());
    const OptionHandle cameras = addText(command, "--cameras", rendering.cameras, "FILE.json|stored (default: stored)",
                                         "cameras to draw: those stored in FILE, or of a camera file");
    add(cameras);
    add(addFlag(command, "--ignore-distortion", rendering.ignore_distortion,
                "draw cameras with lens distortion as if they had none, instead of refusing them")
            .rare());
    add(addChoice<CamerasTransform>(command, "--cameras-transform", rendering.cameras_transform,
                                    {{"keep", CamerasTransform::Keep}, {"undo", CamerasTransform::Undo}},
                                    "default: keep, with a warning",
                                    "coordinates of a transforms.json with applied_transform: keep: as they stand; "
                                    "undo: as they were before it was applied")
            .rare()
            .needs(cameras));
    add(addCount(command, "--views", rendering.views, 0, kMaxViews, "N (default: 3)",
                 "number of cameras to draw by FILE and by the reference, evenly spaced; 0 = all")
            .rare());
    add(addNumber(command, "--min-psnr", rendering.min_psnr, {0, 1000}, " dB", "DB (default: 75)",
                  "least PSNR of a picture; a lower one counts as a difference"));
    for (OptionHandle option : addLpipsOptions(command, rendering.lpips))
        add(option);
    add(addChoice<Tier>(command, "--tier", rendering.tier, {{"exact", Tier::Exact}, {"fast", Tier::Fast}},
                        "default: exact", "exactness of FILE's pictures; on a CPU fast is exact"));
    add(addChoice<ReferencePrecision>(command, "--reference", rendering.reference,
                                      {{"float", ReferencePrecision::Float}, {"double", ReferencePrecision::Double}},
                                      "default: float",
                                      "number type of the reference renderer: float rounds as the trainer does")
            .rare());
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
    setFooter(command, "Every attribute of every anchor, every weight and every camera is compared bit\n"
                       "for bit. Exits with 8 if anything differs or a view is below --min-psnr.\n"
                       "\n"
                       "examples:\n"
                       "  gsc compare output/city city.gsc\n"
                       "  gsc compare output/city city.gsc --render --views 5 --format json");
    onParsed(command, invocation, options, runCompare);
}

} // namespace gsc
