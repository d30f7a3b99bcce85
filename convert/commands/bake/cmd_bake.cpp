// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"
#include "convert/commands/checkpoint_options.h"
#include "convert/commands/command.h"
#include "convert/commands/output_name.h"

#include "convert/bake/state/bake_state.h"
#include "convert/write/write_gsc.h"
#include "format/archive/archive.h"
#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include "format/file/temporary.h"
#include <gsc/gsc_file.h>
#include <gsc/gsc_layout.h>
#include <gsc/gsc_reader.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>

namespace gsc {

namespace {

struct BakeCommand {
    std::vector<std::string> inputs;
    std::optional<CropBox> crop;
    std::vector<double> curve; // targets of --curve in dB; empty = not given
    BakeOptions bake;
    CheckpointOptions checkpoint;
    std::vector<std::string> levers;
    bool compact = false, archive = false;
    double target = 0, min_view = 0; // dB of --target-psnr and --min-view-psnr; 0 = not given
};

constexpr Range kTargets{10, 100}; // dB that a target may have

uint32_t leversOf(const std::vector<std::string>& lists)
{
    uint32_t levers = lists.empty() ? kAllLevers : 0;
    std::string names;
    const std::span<const char* const> levers_named(kLeverNames, std::bit_width(kAllLevers));
    for (const char* const name : levers_named)
        names += (names.empty() ? "" : ", ") + std::string(name);
    for (const std::string& list : lists) // each may itself be a list, such as "slots,anchors"
        for (const std::string& word : partsOf(list)) {
            const auto found = std::ranges::find(levers_named, word);
            if (found == levers_named.end())
                throw Error(ErrorCode::Usage, "--levers " + word, "not a lever", "some of " + names,
                            "correct it or leave it out");
            levers |= 1u << (found - levers_named.begin());
        }
    return levers;
}

// Returns true if the first bytes are those of a .gsc file; any other path is taken as a model to be converted.
bool isGscFile(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    char magic[sizeof(kMagic)] = {};
    file.read(magic, sizeof(magic));
    return file && std::memcmp(magic, kMagic, sizeof(kMagic)) == 0;
}

CropBox parseBox(const std::string& name, const std::string& text)
{
    CropBox box;
    size_t count = 0;
    const std::vector<std::string> parts = partsOf(text);
    for (const std::string& part : parts) {
        if (count == 6)
            break;
        (count < 3 ? box.from : box.to)[count % 3] = detail::number(name, part, {-1e30, 1e30}, "");
        ++count;
    }
    if (parts.size() != 6)
        detail::failValue(name, text, parts.size() > 6 ? "has more numbers" : "has fewer numbers",
                          "six numbers X0,Y0,Z0,X1,Y1,Z1, such as 0,0,0,8,8,4");
    for (size_t axis = 0; axis < 3; ++axis)
        if (!(box.from[axis] < box.to[axis]))
            detail::failValue(name, text, "is empty", "the first three numbers below the last three");
    return box;
}

std::vector<double> parseTargets(const std::string& name, const std::string& text)
{
    std::vector<double> targets;
    for (const std::string& part : partsOf(text)) {
        const double target = detail::number(name, part, kTargets, " dB");
        if (std::ranges::find(targets, target) != targets.end())
            throw Error(ErrorCode::Usage, formatString("%s %s", name.c_str(), text.c_str()),
                        formatString("%g dB is there twice", target), "each target once", "leave one out");
        targets.push_back(target);
    }
    return targets;
}

// Throws if an option is given that needs --target-psnr or --curve.
void refuseWithoutTarget(const BakeCommand& command)
{
    const BakeOptions &bake = command.bake, none;
    const char* const given = !command.levers.empty()                              ? "--levers"
                              : command.compact                                    ? "--compact"
                              : !bake.cameras.empty()                              ? "--cameras"
                              : bake.max_bytes > 0                                 ? "--max-bytes"
                              : bake.limits.most_pixels != none.limits.most_pixels ? "--most-pixels"
                              : bake.device.backend != none.device.backend         ? "--backend"
                              : bake.device.ordinal != none.device.ordinal         ? "--device"
                              : !bake.resume.empty()                               ? "--resume"
                              : command.archive                                    ? "--archive"
                                                                                   : nullptr;
    if (given != nullptr)
        throw Error(ErrorCode::Usage, given, "given without --target-psnr",
                    "no such option where files are cut or joined as they are", "pass the target or leave it out");
}

// Temporary folder of this run. It is made when the first path in it is asked for.
class Workplace {
public:
    std::string file(const std::string& name)
    {
        if (!m_folder)
            m_folder.emplace(temporaryFolder() + "/gsc-bake", TemporaryKind::Folder, 0700);
        return m_folder->path() + "/" + name;
    }

private:
    std::optional<Temporary> m_folder;
};

// Paths of all inputs as .gsc files; other models are converted into `workplace`. `keep_all`: also compute the values
// that only a player uses (section SENS).
std::vector<std::string> filesOf(const BakeCommand& command, bool keep_all, Workplace& workplace, Reporter& report)
{
    std::vector<std::string> files;
    for (const std::string& input : command.inputs) {
        if (isGscFile(input)) {
            files.push_back(input);
            continue;
        }
        const Checkpoint checkpoint = readCheckpoint(input, command.checkpoint);
        for (const std::string& warning : checkpoint.warnings)
            report.warning(warning);
        WriteOptions convert;
        convert.output = workplace.file(formatString("whole%zu.gsc", files.size()));
        convert.threads = command.bake.threads;
        convert.sensitivity = keep_all ? SensitivityMode::Sampled : SensitivityMode::None;
        (void)writeGsc(checkpoint, convert, std::bind_front(&Reporter::progress, &report));
        files.push_back(convert.output);
    }
    return files;
}

std::string nameOf(const std::vector<std::string>& inputs)
{
    return inputs.size() == 1 ? inputs[0] : formatString("%s and %zu more", inputs[0].c_str(), inputs.size() - 1);
}

bool makesTile(const BakeCommand& command)
{
    return command.crop || command.inputs.size() > 1;
}

TileOptions tileOptions(const BakeCommand& command, const std::vector<std::string>& files, const std::string& output)
{
    return {files, command.inputs, output, command.bake.overwrite, command.crop, command.bake.threads};
}

TileReport makeTile(const TileOptions& options, Reporter& report)
{
    const TileReport result = joinTiles(options, std::bind_front(&Reporter::progress, &report));
    for (const std::string& warning : result.warnings)
        report.warning(warning);
    return result;
}

// Path of the one file to bake: the input, or, with --crop or several inputs, the file that is cut or joined from them
// first.
std::string wholeFile(const BakeCommand& command, Workplace& workplace, Reporter& report)
{
    const std::vector<std::string> files = filesOf(command, false, workplace, report);
    if (!makesTile(command))
        return files[0];
    const TileOptions options = tileOptions(command, files, workplace.file("tile.gsc"));
    (void)makeTile(options, report);
    return options.output;
}

ErrorCode cutOrJoin(const BakeCommand& command, Reporter& report)
{
    refuseWithoutTarget(command);
    Workplace workplace;
    const TileOptions options = tileOptions(command, filesOf(command, true, workplace, report), command.bake.output);
    const TileReport result = makeTile(options, report);
    report.endProgress(false);
    if (report.json())
        report.object(tilesJson(options, result));
    else
        report.text(tilesText(options, result));
    report.done("baked " + command.bake.name);
    return ErrorCode::Ok;
}

// Writes the archive of a baked file.
void pack(const std::string& baked, const BakeOptions& options, Reporter& report)
{
    const IssueSink sink = throwFirstIssue(options.output);
    const GscFile file(baked, sink);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Full, sink);
    (void)writeArchive(file.bytes(), view, options.output, options.overwrite, {.threads = options.threads},
                       [&](uint64_t done, uint64_t all) { report.progress("archive", done, all); });
}

void tellKept(uint64_t pictures, Reporter& report)
{
    if (pictures > 0)
        report.tell(formatString("%s of a bake before not drawn again", formatCount(pictures, "picture").c_str()));
}

ErrorCode drawCurve(const BakeCommand& command, BakeOptions options, Reporter& report)
{
    Workplace workplace;
    options.input = wholeFile(command, workplace, report);
    const Curve curve =
        bakeCurve(options, command.curve, workplace.file("baked.gsc"), std::bind_front(&Reporter::progress, &report));
    std::vector<std::string> warnings = curve.warnings;
    // the path of a folder may end with a slash
    const std::string name = (std::filesystem::path(command.inputs[0]) / "").parent_path().stem().string();
    OutputFiles written(options.overwrite);
    written.add(options.output, OutputKind::Text, curveLines(name, options, curve));
    written.commit();
    removeBakeState(options.resume, warnings);
    for (const std::string& warning : warnings)
        report.warning(warning);
    tellKept(curve.pictures_kept, report);
    report.endProgress(false);
    if (report.json())
        report.object(curveJson(name, options, options.output, curve));
    else if (!isStandardOutput(options.output))
        report.text(curveText(options.output, curve));
    report.done("baked " + options.name);
    return ErrorCode::Ok;
}

ErrorCode runAsked(const BakeCommand& given, Reporter& report)
{
    BakeCommand command = given;
    BakeOptions& options = command.bake;
    options.name = nameOf(command.inputs);
    options.levers = leversOf(command.levers) | (command.compact ? uint32_t(kLeverCompact) : 0u);
    if (command.target > 0)
        options.target_psnr = command.target;
    if (command.min_view > 0)
        options.min_view_psnr = command.min_view;
    const bool curve = !command.curve.empty();
    if (options.min_view_psnr && !options.target_psnr && !curve)
        throw Error(ErrorCode::Usage, "--min-view-psnr", "given alone", "--target-psnr beside it", "pass that too");
    if (curve && (options.target_psnr || options.min_view_psnr || options.max_bytes > 0))
        throw Error(ErrorCode::Usage, "--curve", "given with a target or a bound", "its own targets alone",
                    "leave out --target-psnr, --min-view-psnr and --max-bytes");
    if (curve && command.archive)
        throw Error(ErrorCode::Usage, "--archive", "given with --curve", "one of them: a curve is no .gsc",
                    "leave one of them out");
    if (!curve)
        checkGscName(options.output);
    std::vector<NamedPath> inputs;
    for (const std::string& input : command.inputs)
        inputs.push_back({input, "INPUT"});
    for (const std::string& cameras : options.cameras)
        inputs.push_back({cameras, "--cameras"});
    std::vector<NamedPath> outputs{{options.output, "--output"}};
    if (!options.resume.empty())
        outputs.push_back({options.resume, "--resume"});
    checkOutputsDiffer(outputs, inputs);
    if (curve)
        checkStandardOutput(options.output, "--output", report.json());
    checkOutput(options.output, curve ? OutputKind::Text : OutputKind::Binary, options.overwrite);
    if (!options.resume.empty()) {
        checkOutput(options.resume, OutputKind::Binary, true);
        checkBakeState(options.resume);
    }
    if (curve)
        return drawCurve(command, options, report);
    if (makesTile(command) && !options.target_psnr)
        return cutOrJoin(command, report);
    Workplace workplace;
    options.input = wholeFile(command, workplace, report);
    BakeOptions baking = options;
    std::optional<Temporary> unpacked; // folder beside the output, where there is room for files of that size
    if (command.archive) {
        unpacked.emplace(resolveOutput(options.output), TemporaryKind::Folder, 0700);
        baking.output = unpacked->path() + "/baked.gsc";
        baking.output_name = options.output;
    }
    const BakeReport result = bake(baking, std::bind_front(&Reporter::progress, &report));
    if (command.archive)
        pack(baking.output, options, report);
    for (const std::string& warning : result.warnings)
        report.warning(warning);
    tellKept(result.pictures_kept, report);
    report.endProgress(false);
    if (report.json())
        report.object(bakeJson(options, result, command.archive));
    else
        report.text(bakeText(options, result, command.archive));
    report.done("baked " + options.name);
    return ErrorCode::Ok;
}

ErrorCode runBake(const BakeCommand& given, Reporter& report)
{
    const std::string& state = given.bake.resume;
    try {
        return runAsked(given, report);
    } catch (const Error& error) {
        std::error_code none;
        if (error.code() != ErrorCode::Interrupted || state.empty() || !std::filesystem::exists(state, none))
            throw;
        throw Error(ErrorCode::Interrupted, "interrupted", "stopped early", "to run to the end",
                    "run the same command again, which goes on from " + state + " (nothing else was written)");
    }
}

} // namespace

void addBakeCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<BakeCommand>();
    BakeOptions& bake = options->bake;
    CLI::App& command =
        addCommand(app, "bake", "Make the smallest file that keeps a stated quality; cut files, and join tiles");
    addTexts(command, "INPUT", options->inputs, "FILE.gsc|MODEL",
             ".gsc file, or a model as `gsc convert` takes it; several tiles of one model are joined")
        .required();
    addText(command, "-o,--output", bake.output, "FILE.gsc|FILE.jsonl", "file to write").required();
    addFlag(command, "-w,--overwrite", bake.overwrite, "replace a file that exists");
    detail::addValue(
        command, "--crop", "X0,Y0,Z0,X1,Y1,Z1",
        "keep only the anchors in this box, in world units: lower corner, then upper corner, which is not part of it",
        [options](const std::string& name, const std::string& text) { options->crop = parseBox(name, text); });
    addNumber(
        command, "--target-psnr", options->target, kTargets, " dB", "DB",
        "least PSNR over all test pictures together, against exact pictures of the whole model; lower makes a smaller "
        "file. Without it only Gaussians that are never drawn are left out, and none where files are cut or joined");
    addNumber(command, "--min-view-psnr", options->min_view, {5, 100}, " dB", "DB (default: 4 below the target)",
              "least PSNR of the worst test picture");
    detail::addValue(
        command, "--curve", "DB,DB,...",
        "instead of one file, measure bytes, memory, time and picture quality at each of these targets: --output is "
        "then a .jsonl file, which `gsc chart` draws",
        [options](const std::string& name, const std::string& text) { options->curve = parseTargets(name, text); });
    addFlag(command, "--archive", options->archive,
            "write the file packed, as `gsc archive` does: only that makes it small");
    addByteSize(command, "--max-bytes", bake.max_bytes, 1, "SIZE",
                "largest size of the file when `gsc archive` has packed it, such as 4M");
    const OptionHandle cameras =
        addTexts(command, "--cameras", bake.cameras, "FILE.json",
                 "camera files to draw test pictures from, instead of the cameras stored in the file");
    addFlag(command, "--ignore-distortion", bake.ignore_distortion,
            "take cameras with lens distortion as if they had none, instead of refusing them")
        .rare()
        .needs(cameras);
    addChoice<CamerasTransform>(command, "--cameras-transform", bake.cameras_transform,
                                {{"keep", CamerasTransform::Keep}, {"undo", CamerasTransform::Undo}},
                                "default: keep, with a warning",
                                "coordinates of a transforms.json with applied_transform: keep: as they stand; undo: "
                                "as they were before it was applied")
        .rare()
        .needs(cameras);
    addInteger(command, "--most-pixels", bake.limits.most_pixels, 1000, 100'000'000, "N (default: 1000000)",
               "most pixels of a test picture; larger cameras are drawn smaller")
        .rare();
    addTexts(command, "--levers", options->levers, "LEVER,...",
             "changes to allow: leave out slots (single Gaussians) or anchors; round features, offsets, scales or "
             "networks; change the order of anchors (default: all)")
        .rare();
    addFlag(command, "--compact", options->compact,
            "round features and offsets so that the model takes 0.56 of the GPU memory, at a PSNR of about 60 dB; for "
            "models of 32 features");
    addChoice<std::string>(command, "--backend", bake.device.backend,
                           {{"auto", "auto"}, {"cpu", "cpu"}, {"cuda", "cuda"}}, "default: auto",
                           "device that draws the test pictures; auto: a GPU if there is one");
    addInteger(command, "--device", bake.device.ordinal, 0, 255, "N (default: 0)",
               "number of the GPU, as in the list of gsc-play backends");
    addText(command, "--resume", bake.resume, "FILE",
            "file to keep measurements in, so that a bake that was stopped can continue; it is removed once the output "
            "is written");
    addInteger(command, "-j,--threads", bake.threads, 0, 1024, "N (default: 0)",
               "threads, 0 = all cores; the file does not depend on them, but may depend on the backend");
    addCheckpointOptions(command, options->checkpoint);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "Half of the cameras measure what each Gaussian and anchor adds to pictures; a\n"
                       "quarter, the search, how far values can be rounded; the last quarter, the\n"
                       "verdict, the quality of the result. Poses between cameras are added to each.\n"
                       "Exits with 8 and writes nothing if the target cannot be reached. Only packing\n"
                       "makes the file small: --archive, or `gsc archive` afterwards.\n"
                       "\n"
                       "examples:\n"
                       "  gsc bake city.gsc -o city50.gsc --target-psnr 50 --archive\n"
                       "  gsc bake output/room -o room.gsc --target-psnr 45 --min-view-psnr 40 \\\n"
                       "      --format json\n"
                       "  gsc bake city.gsc -o city55.gsc --target-psnr 55 --resume city55.state\n"
                       "  gsc bake city.gsc --crop -40,-40,-10,0,0,30 -o tile0.gsc\n"
                       "  gsc bake tile0.gsc tile1.gsc -o both.gsc\n"
                       "  gsc bake city.gsc --curve 60,55,50,45,40 -o city.jsonl && \\\n"
                       "      gsc chart city.jsonl -o city.html");
    onParsed(command, invocation, options, runBake);
}

} // namespace gsc
