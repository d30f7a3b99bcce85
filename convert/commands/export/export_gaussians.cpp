// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/export/export_gaussians.h"

#include "convert/commands/export/gathering.h"
#include "convert/commands/export/measure_gaussians.h"
#include "convert/export/gaussian_fit.h"
#include "convert/export/lod/streamed_sog.h"
#include "convert/viewer/viewer_page.h"
#include <gsc/file/mapped_file.h>
#include "format/file/new_folder.h"
#include <gsc/file/output_file.h>
#include <gsc/gsc_file.h>
#include <gsc/interrupt.h>
#include "runtime/cameras/scene_cameras.h"
#include "runtime/cli/quantity.h"
#include "runtime/cli/version.h"
#include "runtime/frames/shot.h"

#include <charconv>
#include <filesystem>

namespace gsc {

namespace {

// Most cameras that are fitted to, and most that measure the loss, evenly spaced; more change the fit by hundredths of
// a decibel.
constexpr size_t kMostFitCameras = 96, kMostJudges = 12;

const std::string& inputName(const GaussianExportOptions& options)
{
    return options.name.empty() ? options.file : options.name;
}

size_t cameraNumber(const std::vector<Camera>& cameras, const std::string& at)
{
    size_t number = cameras.size(), named = 0;
    for (size_t i = 0; i < cameras.size(); ++i)
        if (cameras[i].name == at && named++ == 0)
            number = i;
    if (named > 1)
        throw Error(ErrorCode::Usage, "--at " + at, formatString("%zu cameras are called so", named), "one",
                    formatString("pass its number, from 0 to %zu (the first is %zu)", cameras.size() - 1, number));
    if (named == 1)
        return number;
    const auto [end, fault] = std::from_chars(at.data(), at.data() + at.size(), number);
    if (fault != std::errc() || end != at.data() + at.size() || number >= cameras.size())
        throw Error(ErrorCode::Usage, "--at " + at, "no such camera",
                    formatString("a name (the first is %s) or a number from 0 to %zu", cameras[0].name.c_str(),
                                 cameras.size() - 1),
                    "choose one of them");
    return number;
}

std::vector<Camera> camerasOf(const Scene& scene, const GaussianExportOptions& options, Reporter& report)
{
    std::vector<std::string> warnings;
    std::vector<Camera> cameras =
        sceneCameras(scene, options.cameras, {options.ignore_distortion, options.cameras_transform, &warnings});
    for (const std::string& text : warnings)
        report.warning(text);
    if (cameras.empty())
        throw Error(ErrorCode::Usage, inputName(options), "no camera stored", "some to fit colours over",
                    "pass a camera file with --cameras");
    return cameras;
}

// `fit`: cameras that the Gaussians are fitted to; `judges`: cameras that measure the loss, which the fit did not use
// unless there is only one view.
struct Views {
    std::vector<Shot> fit, judges;
};

Views chooseViews(const Scene& scene, const std::vector<Camera>& cameras, const std::string& at)
{
    if (!at.empty()) {
        const Shot view = shotOf(scene, cameras[cameraNumber(cameras, at)]);
        return {{view}, {view}};
    }
    Views views;
    for (size_t i = 0; i < cameras.size(); ++i)
        (i % 2 == 0 ? views.fit : views.judges).push_back(shotOf(scene, cameras[i]));
    return {takeEvenly(std::move(views.fit), kMostFitCameras), takeEvenly(std::move(views.judges), kMostJudges)};
}

// Measures the loss. Called after the file was written, so that only the loss is missing if memory is too short.
void judge(const GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& judges,
           const GaussianExportOptions& options, Reporter& report, GaussianExport& result)
{
    result.whole = ifMemoryHolds([&] { result.loss = lossOf(set, scene, judges, options.threads, report); });
}

void writeFile(const GaussianSet& set, const GaussianExportOptions& options, const PieceSink& write)
{
    switch (options.to) {
    case GaussianFileFormat::Ply:
        return writeGaussianPly(set, write);
    case GaussianFileFormat::Spz:
        return writeGaussianSpz(set, write, options.spz_version);
    case GaussianFileFormat::Glb:
        return writeGaussianGlb(set, write);
    case GaussianFileFormat::Sog:
        return writeGaussianSog(set, write, options.threads);
    }
}

void warnOfReaders(uint64_t gaussians, const GaussianExportOptions& options, Reporter& report)
{
    if (options.to == GaussianFileFormat::Spz && gaussians > options.spz_most)
        report.warning(formatString("%s: %s Gaussians, but readers of SPZ that follow Niantic's first ones take %s at "
                                    "most; for these, choose --max-gaussians %llu, or --to sog --lod",
                                    options.output.c_str(), formatCount(gaussians).c_str(),
                                    formatCount(options.spz_most).c_str(), (unsigned long long)options.spz_most));
}

void warnOfLoss(const GaussianExport& result, const GaussianExportOptions& options, Reporter& report)
{
    if (!result.loss || !(result.loss->psnr < kPoorPsnr))
        return;
    report.warning(formatString(
        "%s: its pictures have a PSNR of %.1f dB against exact, which is poor (below %g): fixed Gaussians cannot "
        "follow what this model's networks do; show %s itself (gsc-play draws it without loss, gsc bake makes it "
        "small), "
        "export one view with --at%s, or fit to more cameras with --cameras",
        options.output.c_str(), result.loss->psnr, kPoorPsnr, inputName(options).c_str(),
        result.level_numbers.size() > 1 ? ", try other --levels" : ""));
}

// Replaces `set` by the Gaussians as a viewer reads them from `written`, if the format rounds values; else leaves `set`
// as it is.
void readRounded(GaussianSet& set, const GaussianExportOptions& options, std::span<const std::byte> written)
{
    const auto read = options.to == GaussianFileFormat::Spz   ? readGaussianSpz
                      : options.to == GaussianFileFormat::Sog ? readGaussianSog
                                                              : nullptr;
    if (read == nullptr)
        return;
    set = {};
    set = read(written, options.output);
}

// Returns true for the files and folders that such an export consists of: lod-meta.json, and folders such as 0_12 with
// nothing but the files of a SOG.
bool isOfLevels(const std::filesystem::path& entry)
{
    const std::string name = entry.filename().string();
    if (name == kLodMetaName)
        return true;
    const size_t bar = name.find('_');
    const auto is_number = [](std::string_view text) {
        return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
    };
    if (bar == std::string::npos || !is_number(std::string_view(name).substr(0, bar)) ||
        !is_number(std::string_view(name).substr(bar + 1)) || !std::filesystem::is_directory(entry))
        return false;
    return std::ranges::all_of(std::filesystem::directory_iterator(entry), [](const auto& file) {
        return file.path().filename() == "meta.json" || file.path().extension() == ".webp";
    });
}

constexpr FolderKind kLodFolder = {"folder of levels", "gsc export --lod", {kLodMetaName, nullptr}, isOfLevels};

// Writes all levels, then reads each back to measure its loss. `set` is overwritten.
void exportLevels(GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& judges,
                  const GaussianExportOptions& options, Reporter& report, NewFolder& folder, GaussianExport& result)
{
    {
        const LodModel model = makeLodModel(set);
        const std::vector<size_t> chunks = writeStreamedSog(
            set, model,
            [&](const std::string& name, std::span<const std::byte> content) {
                folder.append(name, content);
                result.bytes += content.size();
            },
            options.threads,
            [&](uint64_t done, uint64_t all) {
                throwIfInterrupted();
                report.progress("write", done, all);
            });
        for (size_t level = 0; level < model.counts.size(); ++level)
            result.lods.push_back({model.counts[level], chunks[level], std::nullopt});
    }
    for (size_t level = 0; level < result.lods.size(); ++level) {
        set = {};
        set = readStreamedSog(
            [&](const std::string& name) {
                const MappedFile file(folder.file(name));
                return std::vector<std::byte>(file.bytes().begin(), file.bytes().end());
            },
            level, options.output);
        if (!judges.empty())
            result.lods[level].loss = lossOf(set, scene, judges, options.threads, report);
    }
    result.loss = result.lods.front().loss;
    report.endProgress(false);
    folder.commit();
}

OrderedJson lossJson(const std::optional<GaussianLoss>& loss)
{
    if (!loss)
        return nullptr;
    return {{"cameras", loss->cameras},
            {"psnr_pooled", jsonNumber(loss->psnr)},
            {"psnr_worst", jsonNumber(loss->worst_psnr)},
            {"worst_camera", loss->worst},
            {"ssim_mean", jsonNumber(loss->ssim)}};
}

OrderedJson choiceJson(const GaussianExport& result, const LevelSet& choice)
{
    return {{"share", choice.share}, {"finest", result.finestOf(choice)}};
}

OrderedJson levelsJson(const GaussianExport& result)
{
    OrderedJson json = choiceJson(result, result.levels);
    json["count"] = result.eligible;
    json["tried"] = OrderedJson::array();
    for (const LevelTrial& trial : result.trials) {
        json["tried"].push_back(choiceJson(result, trial.choice));
        json["tried"].back()["psnr"] = jsonNumber(trial.psnr);
    }
    return json;
}

OrderedJson cameraJson(const Camera& camera)
{
    const double *r = camera.rotation, *t = camera.translation;
    OrderedJson position = OrderedJson::array(), rotation = OrderedJson::array();
    for (size_t i = 0; i < 9; i += 3) {
        position.push_back(-(r[i] * t[0] + r[i + 1] * t[1] + r[i + 2] * t[2]));
        rotation.push_back({r[i], r[i + 1], r[i + 2]});
    }
    return {{"name", camera.name},   {"position", std::move(position)}, {"rotation", std::move(rotation)},
            {"width", camera.width}, {"height", camera.height},         {"fov_x", camera.fov_x},
            {"fov_y", camera.fov_y}};
}

// Levels that are kept without a trial; none: they are chosen by one. Throws Error(Usage) for a level that the model has
// not.
std::optional<LevelSet> levelsAsked(const Scene& scene, const GaussianExportOptions& options, GaussianExport& result)
{
    const ModelView& model = scene.view();
    std::vector<int>& numbers = result.level_numbers;
    for (size_t i = 0; i < model.params->level_count; ++i)
        numbers.push_back(model.levels[i].level);
    if (options.levels == LevelRequest::UpTo) {
        const std::string given = formatString("--levels %d", options.finest);
        if (numbers.size() < 2)
            throw Error(ErrorCode::Usage, given, "the model has no levels", "it with a model that has", "leave it out");
        if (options.finest < numbers.front() || options.finest > numbers.back())
            throw Error(ErrorCode::Usage, given, "no such level",
                        formatString("a number from %d to %d", numbers.front(), numbers.back()), "choose one of them");
        const auto finer = std::ranges::upper_bound(numbers, options.finest);
        return LevelSet{.finest = uint16_t(finer - numbers.begin() - 1)};
    }
    const bool choose = options.levels == LevelRequest::Measured && options.at.empty() && numbers.size() > 1;
    return choose ? std::nullopt : std::optional(LevelSet{});
}

std::string pageOf(const Scene& scene, const std::vector<Camera>& cameras, const GaussianExportOptions& options,
                   const GaussianExport& result, std::span<const std::byte> sog)
{
    const size_t first = options.at.empty() ? 0 : cameraNumber(cameras, options.at);
    const FrameOptions drawn = exactOptionsFor(scene, cameras[first]);
    OrderedJson list = OrderedJson::array();
    for (const Camera& camera : cameras)
        list.push_back(cameraJson(camera));
    OrderedJson model = {{"name", std::filesystem::path(options.file).stem().string()},
                         {"version", toolVersion()},
                         {"at", nullptr},
                         {"bytes", sog.size()},
                         {"background", drawn.background},
                         {"gaussians", gaussiansJson(result)},
                         {"first", first},
                         {"cameras", std::move(list)}};
    if (!options.at.empty())
        model["at"] = cameras[first].name;
    return viewerPage(model, sog);
}

} // namespace

OrderedJson gaussiansJson(const GaussianExport& result)
{
    OrderedJson json = {{"count", result.gaussians},
                        {"fitted", result.fitted},
                        {"sh_degree", result.degree},
                        {"fit_cameras", result.fit_cameras},
                        {"loss", lossJson(result.loss)}};
    if (result.level_numbers.size() > 1)
        json["levels"] = levelsJson(result);
    for (const LodExport& lod : result.lods)
        json["lods"].push_back({{"count", lod.gaussians}, {"chunks", lod.chunks}, {"loss", lossJson(lod.loss)}});
    return json;
}

GaussianExport exportGaussians(const GaussianExportOptions& options, Reporter& report)
{
    if (options.to == GaussianFileFormat::Sog)
        requireSog();
    if (options.to == GaussianFileFormat::Spz && options.spz_version == 4)
        requireSpz4();
    const std::string& name = inputName(options);
    const std::shared_ptr<const Scene> scene =
        Scene::open(std::make_shared<const GscFile>(options.file, throwFirstIssue(name)), name);
    const std::vector<Camera> cameras = camerasOf(*scene, options, report);
    const Views views = chooseViews(*scene, cameras, options.at);
    std::vector<FitView> fit;
    for (const Shot& view : views.fit) {
        FitView& fitted = fit.emplace_back();
        shotEyes(view, 1, &fitted.eye);
        fitted.appearance = shotAppearance(*scene, view);
    }
    const int degree = options.at.empty() ? options.degree : 0;
    const FitOptions fit_options{degree, options.threads, !options.at.empty(),
                                 rasterConstants(*scene->view().params, 0)};
    GaussianExport result;
    const std::optional<LevelSet> choice = levelsAsked(*scene, options, result);
    std::optional<OutputFile> file;
    std::optional<NewFolder> folder;
    if (options.lod)
        folder.emplace(options.output, options.overwrite, kLodFolder);
    else
        file.emplace(options.output, OutputKind::Binary, options.overwrite);
    Gathering gathering(options, degree, choice, file ? &*file : nullptr);
    fitGaussians(
        scene->view(), fit, fit_options, [&](GaussianSet&& part) { gathering.add(std::move(part)); },
        [&](uint64_t done, uint64_t all) {
            throwIfInterrupted();
            report.progress("fit", done, all);
        });
    if (gathering.count == 0)
        throw Error(ErrorCode::Usage, name, "none of the cameras shows a Gaussian", "some",
                    "pass cameras that look at the model with --cameras");
    GaussianSet set = std::move(gathering.set);
    if (choice) {
        result.levels = *choice;
    } else if (gathering.whole) {
        (void)ifMemoryHolds([&] { result.trials = tryLevels(set, scene, views.fit, options.threads, report); });
        if (!result.trials.empty())
            result.levels = std::ranges::max_element(result.trials, {}, &LevelTrial::psnr)->choice;
        keepLevels(set, result.levels);
    }
    result.fitted = gathering.fitted;
    result.eligible = gathering.whole ? set.size() : gathering.count;
    keepBest(set, size_t(options.most));
    result.gaussians = gathering.whole ? set.size() : gathering.count;
    result.whole = gathering.whole;
    result.degree = degree;
    result.fit_cameras = fit.size();

    if (options.lod) {
        exportLevels(set, scene, views.judges, options, report, *folder, result);
        warnOfLoss(result, options, report);
        return result;
    }
    warnOfReaders(result.gaussians, options, report);
    OutputFile& output = *file;
    std::vector<std::byte> held; // bytes of the SOG that goes into a page
    if (gathering.written > 0) {
        gathering.finish();
        result.bytes = gathering.written;
    } else {
        writeFile(set, options, [&](std::span<const std::byte> piece) {
            throwIfInterrupted();
            if (options.page)
                held.insert(held.end(), piece.begin(), piece.end());
            else
                output.write(piece);
            result.bytes += piece.size();
        });
    }
    if (options.page) {
        readRounded(set, options, held);
    } else {
        output.sync();
        readRounded(set, options, MappedFile(output.temporaryPath()).bytes());
    }
    if (!views.judges.empty() && gathering.whole)
        judge(set, scene, views.judges, options, report, result);
    if (options.page) {
        const std::string page = pageOf(*scene, cameras, options, result, held);
        output.write(page);
        output.sync();
        result.bytes = page.size();
    }
    report.endProgress(false);
    output.commit();
    warnOfLoss(result, options, report);
    return result;
}

} // namespace gsc
