// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"
#include "convert/commands/checkpoint_options.h"
#include "convert/commands/command.h"

#include "convert/bake/bake.h"
#include "format/file/output_file.h"
#include "format/file/output_paths.h"
#include "format/file/temporary.h"
#include "format/gsc_layout.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

namespace gsc {

namespace {

struct BakeCommand {
    ReduceOptions reduce;
    CheckpointOptions checkpoint;
    std::vector<std::string> levers;
    double target = 0, min_view = 0; // dB, 0 = not given
};

uint32_t leversOf(const std::vector<std::string>& lists)
{
    uint32_t levers = lists.empty() ? kAllLevers : 0;
    std::string names;
    for (uint32_t i = 0; i < kLevers; ++i)
        names += (i > 0 ? ", " : "") + std::string(kLeverNames[i]);
    for (const std::string& list : lists) // each may be a list itself: "slots,anchors"
        for (size_t at = 0; at <= list.size();) {
            const size_t end = std::min(list.find(',', at), list.size());
            const std::string word = list.substr(at, end - at);
            const auto found = std::find(std::begin(kLeverNames), std::end(kLeverNames), word);
            if (found == std::end(kLeverNames))
                throw Error(ErrorCode::Usage, "--levers " + word + ": not a lever, expected some of " + names +
                                                  "; correct it or leave it out");
            levers |= 1u << (found - std::begin(kLeverNames));
            at = end + 1;
        }
    return levers;
}

// A .gsc file by its first bytes; else it is a model to be converted.
bool isGscFile(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    char magic[sizeof(kMagic)] = {};
    file.read(magic, sizeof(magic));
    return file && std::memcmp(magic, kMagic, sizeof(kMagic)) == 0;
}

ErrorCode runBake(const BakeCommand& command, Reporter& report)
{
    ReduceOptions options = command.reduce;
    options.levers = leversOf(command.levers);
    if (command.target > 0)
        options.target_psnr = command.target;
    if (command.min_view > 0)
        options.min_view_psnr = command.min_view;
    if (options.min_view_psnr && !options.target_psnr)
        throw Error(ErrorCode::Usage, "--min-view-psnr: given alone, expected --target-psnr beside it; pass that too");
    checkOutputsDiffer(std::vector<NamedPath>{{options.output, "--output"}},
                       std::vector<NamedPath>{{options.name, "INPUT"}});
    checkOutput(options.output, OutputKind::Binary, options.overwrite);
    const auto progress = std::bind_front(&Reporter::progress, &report);
    std::optional<Temporary> folder;
    options.input = options.name;
    if (!isGscFile(options.name)) {
        const Checkpoint checkpoint = readCheckpoint(options.name, command.checkpoint);
        for (const std::string& warning : checkpoint.warnings)
            report.warning(warning);
        folder.emplace(resolveOutput((std::filesystem::temp_directory_path() / "gsc-bake").string()),
                       TemporaryKind::Folder, 0700);
        BakeOptions convert;
        convert.output = options.input = folder->path() + "/whole.gsc";
        convert.threads = options.threads;
        convert.sensitivity = SensitivityMode::None;
        (void)bake(checkpoint, convert, progress);
    }
    const ReduceReport result = reduce(options, progress);
    report.endProgress(false);
    if (report.json())
        report.object(bakeJson(options, result));
    else
        report.text(bakeText(options, result));
    report.done("baked " + options.name);
    return ErrorCode::Ok;
}

} // namespace

void addBakeCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<BakeCommand>();
    ReduceOptions& reduce = options->reduce;
    CLI::App& command = addCommand(app, "bake", "Make the smallest file that keeps a stated quality");
    addText(command, "INPUT", reduce.name, "FILE.gsc|MODEL", "a .gsc file, or a model as `gsc convert` takes it")
        .required();
    addText(command, "-o,--output", reduce.output, "FILE.gsc", "file to write").required();
    addFlag(command, "-w,--overwrite", reduce.overwrite, "replace a file that exists");
    addNumber(
        command, "--target-psnr", options->target, {10, 100}, " dB", "DB",
        "of all judged poses together, against exact pictures of the whole model; without it only what never draws "
        "is left out");
    addNumber(command, "--min-view-psnr", options->min_view, {5, 100}, " dB", "DB (default: 4 below the target)",
              "of the worst judged pose");
    addByteSize(command, "--max-bytes", reduce.max_bytes, 1, "SIZE", "most bytes of the file's archive, such as 4M");
    addTexts(command, "--cameras", reduce.cameras, "FILE.json",
             "camera files to look from instead of the cameras stored in the file");
    addInteger(command, "--most-pixels", reduce.limits.most_pixels, 1000, 100'000'000, "N (default: 1000000)",
               "of a picture that is drawn to judge; larger cameras are drawn smaller");
    addTexts(command, "--levers", options->levers, "LEVER,...",
             "what may be done: slots, anchors, features, offsets, scales, networks, order (default: all)");
    addInteger(command, "-j,--threads", reduce.threads, 0, 1024, "N (default: 0)",
               "threads, 0 = all cores; the bytes do not depend on it");
    addCheckpointOptions(command, options->checkpoint);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(
        command,
        "Half of the cameras say what slots and anchors are worth, a quarter of them how coarse values may be, and\n"
        "a quarter, never looked from before, give the verdict; poses between neighbours join each of them. Exits\n"
        "with 8 where the target cannot be kept, and writes nothing. `gsc archive` then packs the file.\n\n"
        "examples:\n"
        "  gsc bake city.gsc -o city50.gsc --target-psnr 50\n"
        "  gsc bake output/room -o room.gsc --target-psnr 45 --min-view-psnr 40 --format json");
    onParsed(command, invocation, options, runBake);
}

} // namespace gsc
