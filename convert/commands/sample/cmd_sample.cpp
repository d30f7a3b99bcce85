// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/sample/sample.h"
#include <gsc/file/output_paths.h>
#include <gsc/gsc_layout.h>
#include "runtime/cli/version.h"

#include <filesystem>
#include <functional>
#include <limits>

namespace gsc {

namespace {

constexpr int64_t kMaxSeed = std::numeric_limits<int64_t>::max();

ErrorCode reportSample(const std::string& kind, const std::string& output, uint64_t seed, const SampleReport& sample,
                       Reporter& report)
{
    report.endProgress(false);
    if (report.json())
        report.object({{"schema", "gsc.sample/1"},
                       {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
                       {"kind", kind},
                       {"output", output},
                       {"seed", seed},
                       {"anchors", sample.anchors},
                       {"tiles", sample.tiles},
                       {"ply_bytes", sample.ply_bytes},
                       {"path_file", sample.path_file},
                       {"seconds", jsonNumber(sample.seconds)},
                       {"peak_memory_bytes", peakMemoryBytes()}});
    else {
        std::string text =
            formatString("wrote       %s, %s, PLY of %s\n", output.c_str(),
                         formatCount(sample.anchors, "anchor").c_str(), formatBytes(sample.ply_bytes).c_str());
        if (sample.tiles)
            text += formatString("tiles       %s\n", formatCount(sample.tiles).c_str());
        if (!sample.path_file.empty())
            text += "camera path " + sample.path_file + "\n";
        report.text(text);
    }
    report.done("made " + output);
    return ErrorCode::Ok;
}

ErrorCode runSample(const std::string& kind, const SampleOptions& options, Reporter& report)
{
    checkOutputFolder(options.output, options.overwrite);
    return reportSample(kind, options.output, options.seed,
                        makeSample(options, std::bind_front(&Reporter::progress, &report)), report);
}

// Folders that the output must not replace: the checkpoint, and the model folder around it if the user passed an
// iteration folder or a PLY.
std::vector<NamedPath> foldersOf(const std::string& checkpoint)
{
    std::vector<NamedPath> folders = {{checkpoint, "the checkpoint"}};
    std::error_code ignored;
    for (auto path = std::filesystem::weakly_canonical(checkpoint, ignored); path.has_relative_path();
         path = path.parent_path())
        if (path.filename() == "point_cloud")
            folders.push_back({path.parent_path().string(), "the checkpoint"});
    return folders;
}

ErrorCode runReplicate(const ReplicateOptions& options, Reporter& report)
{
    checkOutputsDiffer(std::vector<NamedPath>{{options.output, "--output"}}, foldersOf(options.input));
    checkOutputFolder(options.output, options.overwrite);
    return reportSample("replicate", options.output, options.seed,
                        replicateCheckpoint(options, std::bind_front(&Reporter::progress, &report)), report);
}

void addSceneCommand(CLI::App& parent, Invocation& invocation, const char* name, const char* help, SampleScene scene)
{
    auto options = std::make_shared<SampleOptions>();
    options->scene = scene;
    CLI::App& command = addCommand(parent, name, help);
    addText(command, "-o,--output", options->output, "DIR", "model folder to create").required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace a model that exists");
    addCount(command, "--anchors", options->anchors, 1, kMaxAnchors, "N (default: 100k)",
             "number of anchors, such as 20M");
    addChoice<SampleModel>(command, "--model", options->model,
                           {{"scaffold", SampleModel::Scaffold}, {"octree", SampleModel::Octree}}, "default: scaffold",
                           "trainer whose layout is written");
    addInteger(command, "--seed", options->seed, 0, kMaxSeed, "N (default: 1)",
               "seed of the random numbers; the same seed makes the same bytes");
    addFlag(command, "--everything-on", options->everything_on,
            "give the networks every input that the trainers know: feature bank, appearance, distance, level")
        .rare();
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, formatString("example:\n  gsc sample %s --anchors 300k --model octree -o %s", name, name));
    onParsed(command, [options, name, &invocation] {
        invocation.run = [options, name](Reporter& report) { return runSample(name, *options, report); };
    });
}

void addReplicateCommand(CLI::App& parent, Invocation& invocation)
{
    auto options = std::make_shared<ReplicateOptions>();
    CLI::App& command = addCommand(parent, "replicate", "Tile a real aerial model into a city, with camera paths");
    addText(command, "CHECKPOINT", options->input, "MODEL|FILE.ply", "model to tile").required();
    addText(command, "-o,--output", options->output, "DIR", "model folder to create").required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace a model that exists");
    addCount(command, "--anchors", options->anchors, 2, kMaxAnchors, "N (default: 1.3M)",
             "number of anchors, such as 18.5M");
    addInteger(command, "--seed", options->seed, 0, kMaxSeed, "N (default: 1)",
               "seed of the random numbers; the same seed makes the same bytes");
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "example:\n  gsc sample replicate output/village --anchors 18.5M -o big");
    onParsed(command, invocation, options, runReplicate);
}

} // namespace

void addSampleCommand(CLI::App& app, Invocation& invocation)
{
    CLI::App& command = addCommand(app, "sample", "Make a checkpoint in the trainers' own layout, or camera paths");
    takesCommand(command);
    addSceneCommand(command, invocation, "city", "Blocks, streets, facades and trees", SampleScene::City);
    addSceneCommand(command, invocation, "street", "One street, seen from the ground", SampleScene::Street);
    addSceneCommand(command, invocation, "room", "A furnished room", SampleScene::Room);
    addReplicateCommand(command, invocation);
    addSamplePathsCommand(command, invocation);
}

} // namespace gsc
