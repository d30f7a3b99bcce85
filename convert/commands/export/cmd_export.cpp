// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/commands/export/export_gaussians.h"
#include "convert/commands/output_name.h"
#include "convert/grids/grid_files.h"
#include "convert/input/checkpoint.h"
#include "convert/write/write_gsc.h"
#include "format/file/path_ending.h"
#include "format/file/trained_model.h"
#include "runtime/cli/printed_command.h"
#include "runtime/records/report_parts.h"
#include <gsc/file/output_file.h>
#include <gsc/gsc_file.h>

#include <algorithm>
#include <functional>
#include <optional>

namespace gsc {

namespace {

enum class ExportForm { NanoVdb, OpenVdb, Ply, Spz, Glb, Sog, Page };

struct FormName {
    ExportForm form;
    const char* name;
    const char* what;
};

constexpr FormName kForms[] = {{ExportForm::Ply, "ply", "3DGS PLY"},
                               {ExportForm::Spz, "spz", "SPZ"},
                               {ExportForm::Glb, "glb", "glTF with KHR_gaussian_splatting"},
                               {ExportForm::Sog, "sog", "SOG, version 2"},
                               {ExportForm::NanoVdb, "nvdb", "NanoVDB mask grids"},
                               {ExportForm::OpenVdb, "vdb", "OpenVDB mask grids"},
                               {ExportForm::Page, "html", "a page that shows it, the model in it as SOG"}};

const FormName& nameOf(ExportForm form)
{
    return *std::ranges::find(kForms, form, &FormName::form);
}

// Returns the form that a file's name says, or none for another ending.
std::optional<ExportForm> formOf(const std::string& output)
{
    const std::string ending = endingOf(output);
    const auto found =
        std::ranges::find_if(kForms, [&](const FormName& form) { return ending == std::string(".") + form.name; });
    return found == std::end(kForms) ? std::nullopt : std::optional(found->form);
}

struct ExportOptions {
    std::string model;                // .gsc, or trained model that is converted first
    ExportForm to = ExportForm::Page; // form of the output; Page if --to is not given
    std::string page;                 // path of the page, --html
    GaussianExportOptions gaussians;  // options of the forms that hold Gaussians
    int degree = -1;                  // degree of the colours' harmonics; -1 = not given
    uint64_t most = 0;
    int spz_version = 0; // 3 or 4; 0 = not given
    bool levels = false; // --levels is given
};

bool isGrid(ExportForm form)
{
    return form == ExportForm::NanoVdb || form == ExportForm::OpenVdb;
}

// Throws if an option is given that would change nothing in this form.
void refuseIdle(const ExportOptions& options)
{
    const GaussianExportOptions& gaussians = options.gaussians;
    const char* idle = !gaussians.at.empty()         ? "at"
                       : !gaussians.cameras.empty()  ? "cameras"
                       : options.degree >= 0         ? "sh"
                       : options.most > 0            ? "max-gaussians"
                       : options.levels              ? "levels"
                       : gaussians.ignore_distortion ? "ignore-distortion"
                       : gaussians.memory_budget > 0 ? "memory-budget"
                                                     : nullptr;
    if (options.spz_version > 0 && options.to != ExportForm::Spz)
        throw Error(ErrorCode::Usage, formatString("--spz-version %d", options.spz_version),
                    "only SPZ has that version", "it with --to spz", "leave it out");
    if (gaussians.lod && options.to != ExportForm::Sog)
        throw Error(ErrorCode::Usage, "--lod", "only SOG is streamed", "it with --to sog", "leave it out");
    if (isGrid(options.to) && idle != nullptr)
        throw Error(ErrorCode::Usage, formatString("--%s", idle), "grids hold no Gaussians",
                    "it with --to ply, spz, glb or sog", "leave it out");
    if (!gaussians.at.empty() && options.levels)
        throw Error(ErrorCode::Usage, "--levels", "one camera sees the levels that are right for it", "none with --at",
                    "leave one of them out");
    if (!gaussians.at.empty() && options.degree > 0)
        throw Error(ErrorCode::Usage, formatString("--sh %d", options.degree),
                    "what one camera sees has colours of degree 0", "no other with --at", "leave one of them out");
}

void parseLevels(const std::string& name, const std::string& text, ExportOptions& options)
{
    options.levels = true;
    GaussianExportOptions& gaussians = options.gaussians;
    gaussians.levels = text == "auto" ? LevelRequest::Measured : text == "all" ? LevelRequest::All : LevelRequest::UpTo;
    if (gaussians.levels == LevelRequest::UpTo)
        gaussians.finest = int(detail::wholeNumber(name, text, 0, kMaxLevelValue));
}

std::string choiceText(const GaussianExport& result, const LevelSet& choice)
{
    if (choice.share > 0)
        return formatString("anchors that %g %% of their views draw", double(choice.share) * 100);
    const int finest = result.finestOf(choice);
    return finest == result.level_numbers.back() ? "all" : formatString("up to level %d", finest);
}

// Tells which levels were exported; empty for models without.
std::string levelsText(const GaussianExport& result)
{
    if (result.level_numbers.size() < 2)
        return "";
    std::string text = "levels      " + choiceText(result, result.levels);
    if (result.eligible < result.fitted)
        text += formatString(", %s of %s", formatCount(result.eligible).c_str(),
                             formatCount(result.fitted, "Gaussian").c_str());
    if (result.trials.empty())
        return text + "\n";
    text += "\ntried       ";
    for (const LevelTrial& trial : result.trials)
        text += formatString("%s%s %s", &trial == result.trials.data() ? "" : ", ",
                             trial.choice.share > 0 ? formatString("%g %%", double(trial.choice.share) * 100).c_str()
                                                    : choiceText(result, trial.choice).c_str(),
                             decibels(trial.psnr, " dB").c_str());
    return text + "; small pictures of cameras of the fit\n";
}

std::string writtenText(const ExportOptions& options, uint64_t bytes)
{
    std::string what = nameOf(options.to).what;
    if (options.to == ExportForm::Spz)
        what += formatString(", version %d", options.gaussians.spz_version);
    if (options.gaussians.lod)
        what = "streamed SOG";
    return formatString("wrote       %s, %s, %s\n", options.gaussians.output.c_str(), formatBytes(bytes).c_str(),
                        what.c_str());
}

Json reportHead(const ExportOptions& options, uint64_t bytes)
{
    return {{"schema", "gsc.export/1"},
            {"path", options.model},
            {"output", options.gaussians.output},
            {"to", nameOf(options.to).name},
            {"bytes", bytes}};
}

void exportGrids(const ExportOptions& options, Reporter& report)
{
    const std::string& path = options.gaussians.file;
    const IssueSink sink = throwFirstIssue(options.model);
    const GscFile file(path, sink);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Index, sink);
    OutputFile output(options.gaussians.output, OutputKind::Binary, options.gaussians.overwrite);
    uint64_t bytes = 0;
    const GridFileFormat format = options.to == ExportForm::NanoVdb ? GridFileFormat::NanoVdb : GridFileFormat::OpenVdb;
    const std::vector<ExportedGrid> grids = writeGridFile(view, format, sink, [&](std::string_view piece) {
        output.write(piece);
        bytes += piece.size();
    });
    output.sync();
    output.commit();

    Json levels = Json::array();
    std::string text = writtenText(options, bytes);
    for (const ExportedGrid& grid : grids) {
        levels.push_back({{"level", grid.level},
                          {"name", grid.name},
                          {"leaves", grid.leaves},
                          {"voxels", grid.voxels},
                          {"voxel_size", grid.voxel_size}});
        text += formatString("level %-5d %s: %s, %s with anchors, %g wide\n", grid.level, grid.name.c_str(),
                             formatCount(grid.leaves, "leaf", "leaves").c_str(),
                             formatCount(grid.voxels, "voxel").c_str(), grid.voxel_size);
    }
    Json json = reportHead(options, bytes);
    json["grids"] = std::move(levels);
    if (report.json())
        report.object(json);
    else
        report.text(text);
}

void exportExplicit(const ExportOptions& options, Reporter& report)
{
    GaussianExportOptions gaussians = options.gaussians;
    if (options.degree >= 0)
        gaussians.degree = options.degree;
    if (options.most > 0)
        gaussians.most = options.most;
    gaussians.to = options.to == ExportForm::Ply   ? GaussianFileFormat::Ply
                   : options.to == ExportForm::Spz ? GaussianFileFormat::Spz
                   : options.to == ExportForm::Glb ? GaussianFileFormat::Glb
                                                   : GaussianFileFormat::Sog;
    gaussians.page = options.to == ExportForm::Page;
    const GaussianExport result = exportGaussians(gaussians, report);
    Json json = reportHead(options, result.bytes);
    json["gaussians"] = gaussiansJson(result);
    if (report.json())
        return report.object(json);
    std::string text = writtenText(options, result.bytes);
    text += formatString("gaussians   %s", formatCount(result.gaussians).c_str());
    if (result.gaussians < result.eligible)
        text += formatString(" of %s, those that may cover most", formatCount(result.eligible).c_str());
    text +=
        formatString("; colours of degree %d, %s\n", result.degree,
                     options.gaussians.at.empty() ? ("fitted over " + formatCount(result.fit_cameras, "camera")).c_str()
                                                  : ("as camera " + options.gaussians.at + " sees them").c_str());
    text += levelsText(result);
    for (size_t level = 0; level < result.lods.size(); ++level) {
        const LodExport& lod = result.lods[level];
        text += formatString("level %-5zu %s, %s%s\n", level, formatCount(lod.gaussians, "Gaussian").c_str(),
                             formatCount(lod.chunks, "chunk").c_str(),
                             lod.loss ? (", PSNR alone " + decibels(lod.loss->psnr, " dB")).c_str() : "");
    }
    if (!result.whole)
        text += "loss        not measured: the Gaussians take more than half of memory, or than --memory-budget\n";
    else if (!result.loss)
        text += "loss        not measured: no camera is left that the fit did not use; pass more with --cameras\n";
    else
        text += formatString("loss        PSNR %s against exact, pooled over %s; worst %s (%s); SSIM %.4f\n",
                             decibels(result.loss->psnr, " dB").c_str(),
                             options.gaussians.at.empty()
                                 ? (formatCount(result.loss->cameras, "camera") + " that the fit did not use").c_str()
                                 : "that camera",
                             decibels(result.loss->worst_psnr, " dB").c_str(), result.loss->worst.c_str(),
                             result.loss->ssim);
    report.text(text);
}

// Writes the .gsc of a trained model for this run.
void convertTo(const TemporaryGsc& file, const std::string& model, int threads, Reporter& report)
try {
    const Checkpoint checkpoint = readCheckpoint(model, {});
    for (const std::string& warning : checkpoint.warnings)
        report.warning(convertAdvice(warning));
    WriteOptions write;
    write.output = file.path();
    write.threads = threads;
    for (const std::string& warning :
         writeGsc(checkpoint, write, std::bind_front(&Reporter::progress, &report)).warnings)
        report.warning(convertAdvice(warning));
    report.endProgress(false);
    report.tell(model + ": converted for this run; gsc convert " + shellWord(model) + " keeps the file");
} catch (const Error& error) {
    throw Error(error.code(), error.subject(), error.found(), error.expected(), convertAdvice(error.remedy()))
        .with(error.settings());
}

// Sets the form, which --to, --html and the output's name must not contradict, and then both paths of a page.
void chooseForm(ExportOptions& options)
{
    const bool page = !options.page.empty();
    std::string& output = options.gaussians.output;
    if (page)
        output = options.page;
    const std::string said = page ? "--html" : "--output";
    const std::optional<ExportForm> named = formOf(output);
    const bool chosen = page || options.to != ExportForm::Page;
    if (!chosen && !named)
        throw Error(ErrorCode::Usage, "--to", "not given, and the name " + output + " says no form",
                    "an ending such as .ply, or --to", "see gsc export --help");
    if (!chosen)
        options.to = *named;
    const std::string ending = endingOf(output);
    if (ending == ".gsc" || isForeignEnding(ending) || (named && *named != options.to))
        throw Error(ErrorCode::Usage, said + " " + output,
                    "is named as a " + ending + " file, and would hold " + nameOf(options.to).what,
                    std::string("a name that ends with .") + nameOf(options.to).name,
                    page ? "choose such a name" : "choose such a name, or another --to");
    if (options.to == ExportForm::Page)
        options.page = output;
}

ErrorCode runExport(const ExportOptions& given, Reporter& report)
{
    ExportOptions options = given;
    GaussianExportOptions& common = options.gaussians;
    if (options.page.empty() && common.output.empty())
        throw Error(ErrorCode::Usage, "--output", "not given", "-o FILE", "see gsc export --help");
    chooseForm(options);
    refuseIdle(options);
    if (options.spz_version > 0)
        common.spz_version = options.spz_version;
    std::vector<NamedPath> inputs = {{options.model, "FILE"}};
    if (!common.cameras.empty() && common.cameras != "stored")
        inputs.push_back({common.cameras, "--cameras"});
    checkOutputsDiffer(std::vector<NamedPath>{{common.output, options.page.empty() ? "--output" : "--html"}}, inputs);
    if (common.lod)
        checkOutputFolder(common.output, common.overwrite);
    else
        checkOutput(common.output, OutputKind::Binary, common.overwrite);
    std::optional<TemporaryGsc> converted;
    if (isTrainedModel(options.model))
        convertTo(converted.emplace(options.model), options.model, common.threads, report);
    common.file = converted ? converted->path() : options.model;
    common.name = options.model;
    if (isGrid(options.to))
        exportGrids(options, report);
    else
        exportExplicit(options, report);
    report.done("exported " + options.model);
    return ErrorCode::Ok;
}

} // namespace

void addExportCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ExportOptions>();
    GaussianExportOptions& gaussians = options->gaussians;
    CLI::App& command = addCommand(app, "export", "Write the Gaussians or grids of a .gsc file for other programs");
    addText(command, "FILE", options->model, "FILE.gsc|MODEL", "file to read, or a trained model's folder").required();
    std::vector<std::pair<std::string, ExportForm>> forms;
    for (const FormName& form : kForms)
        if (form.form != ExportForm::Page)
            forms.emplace_back(form.name, form.form);
    const OptionHandle to = addChoice<ExportForm>(
        command, "--to", options->to, forms, "default: the ending of FILE",
        "Gaussians for viewers of 3DGS (ply, spz, glb, sog), or the grids, one per level, for NanoVDB's "
        "or OpenVDB's tools");
    const OptionHandle output = addText(command, "-o,--output", gaussians.output, "FILE",
                                        "file to write, such as room.ply; with --lod a folder");
    addText(command, "--html", options->page, "FILE.html",
            "web page to write instead, which shows the Gaussians in any browser, offline")
        .excludes(to)
        .excludes(output);
    addFlag(command, "-w,--overwrite", gaussians.overwrite, "replace a file that exists");
    {
        const Heading heading(command, "Gaussians");
        addInteger(command, "--sh", options->degree, 0, kMostShDegree, "0..3 (default: 3)",
                   "degree of the spherical harmonics that colours are fitted with; higher follows the view better in "
                   "more bytes");
        addText(command, "--at", gaussians.at, "CAMERA",
                "name or number of a camera: export the Gaussians as that camera sees them, with colours of degree 0")
            .rare();
        const OptionHandle cameras = addText(
            command, "--cameras", gaussians.cameras, "FILE.json|stored (default: stored)",
            "cameras to fit colours to: every other one, at most 96; at most 12 of the rest measure what was lost");
        addFlag(command, "--ignore-distortion", gaussians.ignore_distortion,
                "take cameras with lens distortion as if they had none, instead of refusing them")
            .rare();
        addChoice<CamerasTransform>(command, "--cameras-transform", gaussians.cameras_transform,
                                    {{"keep", CamerasTransform::Keep}, {"undo", CamerasTransform::Undo}},
                                    "default: keep, with a warning",
                                    "coordinates of a transforms.json with applied_transform: keep: as they stand; "
                                    "undo: as they were before it was applied")
            .rare()
            .needs(cameras);
        addCount(command, "--max-gaussians", options->most, 1, UINT32_MAX, "N",
                 "keep only the N Gaussians that may cover most of the cameras' pictures");
        detail::addValue(
            command, "--levels", "auto|all|N (default: auto)",
            "levels of an Octree-GS model, whose pictures never show all at once: auto: those whose small pictures "
            "lose "
            "least; all; or up to level N",
            [options](const std::string& name, const std::string& text) { parseLevels(name, text, *options); });
        addFlag(command, "--lod", gaussians.lod,
                "with --to sog, write a folder of levels of detail in chunks, which a viewer loads as it needs them");
        addInteger(command, "--spz-version", options->spz_version, 3, 4, "3|4 (default: 3)",
                   "version of the SPZ file: Spark 2.2 reads 3, PlayCanvas 2.23 reads 4")
            .rare();
        addByteSize(command, "--memory-budget", gaussians.memory_budget, 1, "SIZE (default: half of memory)",
                    "most memory for Gaussians; only a PLY may have more, and its loss is then not measured");
        addInteger(command, "-j,--threads", gaussians.threads, 0, 4096, "N (default: 0)", "threads, 0 = all cores");
    }
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "Other viewers do not evaluate networks: colours that depend on the view become\n"
                       "spherical harmonics. The report says how much PSNR that costs against tier\n"
                       "exact, on cameras that the fit did not use. A grid is a mask: its voxels are the\n"
                       "cells that hold anchors, in the model's world space.\n"
                       "\n"
                       "examples:\n"
                       "  gsc export room.gsc -o room.ply\n"
                       "  gsc export room.gsc --sh 1 --max-gaussians 500K -o room.spz\n"
                       "  gsc export city.gsc --to sog --lod -o city\n"
                       "  gsc export room.gsc -o room.html\n"
                       "  gsc export city.gsc -o city.vdb");
    onParsed(command, invocation, options, runExport);
}

} // namespace gsc
