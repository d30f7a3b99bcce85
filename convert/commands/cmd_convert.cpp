// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"
#include "convert/commands/command.h"
#include "convert/commands/convert_report.h"
#include "convert/commands/output_name.h"

#include "convert/compare/compare_checkpoint.h"
#include "convert/write/model_sections.h"
#include <gsc/file/output_file.h>
#include <gsc/gsc_layout.h>

#include <filesystem>
#include <functional>

namespace gsc {

namespace {

struct ConvertOptions {
    std::string input;
    CheckpointOptions checkpoint;
    WriteOptions write;
    std::string appearance = "all";
    std::string report;
    bool dry_run = false;
    bool verify = false;
};

int parseAppearance(const std::string& text)
{
    if (text == "all")
        return -1;
    const bool digits = !text.empty() && text.size() < 9 && text.find_first_not_of("0123456789") == std::string::npos;
    if (!digits)
        throw Error(ErrorCode::Usage, "--appearance " + text, "not a row", "a row of the embedding (0, 1, ...) or all",
                    "correct it or leave it out");
    return std::stoi(text);
}

std::vector<NamedPath> outputsOf(const ConvertOptions& options)
{
    std::vector<NamedPath> outputs = {{options.write.output, "--output"}};
    if (!options.report.empty())
        outputs.push_back({options.report, "--report"});
    return outputs;
}

// Files that the command must not overwrite, even with -w: those of the checkpoint, and others that its trainer wrote.
std::vector<NamedPath> filesOf(const Checkpoint& checkpoint, const std::string& scene_dir)
{
    const char* const what = "a file of the checkpoint";
    std::vector<NamedPath> files = {{checkpoint.ply_path, what}};
    for (const std::string& path : checkpoint.weight_paths)
        files.push_back({path, what});
    std::vector<std::filesystem::path> folders = {checkpoint.model_path};
    if (!scene_dir.empty())
        folders.emplace_back(scene_dir);
    // the user may have passed the iteration folder or the PLY: settings lie up to three folders above it
    std::error_code ignored;
    std::filesystem::path above = std::filesystem::weakly_canonical(checkpoint.ply_path, ignored).parent_path();
    for (int i = 0; i < 4 && above.has_relative_path(); ++i, above = above.parent_path())
        folders.push_back(above);
    for (const std::filesystem::path& folder : folders)
        for (const char* name : {"cfg_args", "config.yaml", "cameras.json", "transforms.json", "transforms_train.json",
                                 "transforms_test.json", "input.ply"})
            files.push_back({(folder / name).string(), what});
    return files;
}

// Throws unless the file holds every value of the checkpoint bit for bit. `path`: where the file lies now; `output`:
// its later name, for messages.
void verifyFile(const Checkpoint& checkpoint, const std::string& path, const std::string& output,
                const WriteProgress& progress)
{
    CompareReport comparison;
    try {
        comparison = compareCheckpoint(checkpoint, path, progress);
    } catch (const Error& error) {
        if (error.subject() == path)
            throw error.about(output);
        throw;
    }
    if (!comparison.equal)
        throw internalError(output,
                            "not written, because it would differ from the checkpoint (" + comparison.summary() + ")",
                            "no difference");
}

// Returns MODEL.gsc beside the model: the name of a folder, or of a PLY without its ending. A symbolic link is
// not followed.
std::string defaultOutput(const std::string& input)
{
    std::error_code ignored;
    std::filesystem::path path = std::filesystem::absolute(input, ignored).lexically_normal();
    if (path.filename().empty())
        path = path.parent_path();
    if (path.extension() == ".ply")
        path.replace_extension();
    return path.string() + ".gsc";
}

ErrorCode runConvert(const ConvertOptions& given, Reporter& report)
{
    ConvertOptions options = given;
    if (options.write.output.empty())
        options.write.output = defaultOutput(options.input);
    checkGscName(options.write.output);
    WriteOptions write_options = options.write;
    write_options.appearance = parseAppearance(options.appearance);
    const std::vector<NamedPath> outputs = outputsOf(options);
    checkOutputsDiffer(outputs, std::vector<NamedPath>{{options.input, "the input"}});
    checkOutput(write_options.output, OutputKind::Binary, write_options.overwrite);
    if (!options.report.empty())
        checkOutput(options.report, OutputKind::Text, write_options.overwrite);
    checkStandardOutput(options.report, "--report", report.json());

    const Checkpoint checkpoint = readCheckpoint(options.input, options.checkpoint);
    // so that --dry-run also refuses a wrong --appearance
    (void)keptEmbeddingRows(checkpoint, write_options.appearance);
    checkOutputsDiffer(outputs, filesOf(checkpoint, options.checkpoint.scene_dir));

    ConvertFacts facts{checkpoint, write_options, nullptr, false, checkpoint.warnings, 0};
    for (const std::string& warning : facts.warnings)
        report.warning(warning);
    WriteReport written;
    if (!options.dry_run) {
        const WriteProgress progress = std::bind_front(&Reporter::progress, &report);
        if (options.verify)
            write_options.verify = [&](const std::string& path) {
                verifyFile(checkpoint, path, write_options.output, progress);
                facts.verified = true;
            };
        written = writeGsc(checkpoint, write_options, progress);
        facts.written = &written;
        for (const std::string& warning : written.warnings) {
            report.warning(warning);
            facts.warnings.push_back(warning);
        }
        report.endProgress(false);
    }
    facts.seconds = report.seconds();
    if (!options.report.empty())
        writeTextFile(options.report, jsonText(convertJson(facts)) + "\n", write_options.overwrite);
    if (report.json())
        report.object(convertJson(facts));
    // the text goes to standard error, because the report is on standard output
    else if (isStandardOutput(options.report))
        report.tell(convertText(facts));
    else
        report.text(convertText(facts));
    report.done(options.dry_run ? "dry run of " + options.input : "converted " + options.input);
    return ErrorCode::Ok;
}

void addBakeOptions(CLI::App& command, ConvertOptions& options)
{
    addText(command, "-o,--output", options.write.output, "FILE.gsc (default: MODEL.gsc)", "file to write");
    addFlag(command, "-w,--overwrite", options.write.overwrite, "replace files that exist");
    addText(command, "--report", options.report, "FILE.json",
            "file to write a report to, as JSON; - is standard output");
    const Heading heading(command, "File to write");
    addText(command, "--appearance", options.appearance, "all|ROW (default: all)",
            "row of the appearance embedding (one per training picture) to keep")
        .rare();
    addFlag(command, "--drop-invalid", options.write.drop_invalid,
            "leave out anchors with values that are not finite instead of refusing the model")
        .rare();
    addChoice<SensitivityMode>(command, "--sensitivity", options.write.sensitivity,
                               {{"none", SensitivityMode::None}, {"sampled", SensitivityMode::Sampled}},
                               "default: sampled",
                               "how fast each anchor's look changes with the view, which gsc-play --reuse error needs: "
                               "sampled: measured from six directions; none: not stored")
        .rare();
    addCount(command, "--chunk-anchors", options.write.chunk_anchors, 1, kMaxAnchors, "N (default: 16384)",
             "anchors to aim for in a chunk, the part of the file that is read at once")
        .rare();
    addByteSize(command, "--memory-budget", options.write.memory_budget, 1,
                "SIZE (default: 1G, or a quarter of memory if less)", "most memory for buffers, such as 4G");
    addInteger(command, "-j,--threads", options.write.threads, 0, 4096, "N (default: 0)",
               "threads, 0 = all cores; the file does not depend on it");
    const OptionHandle verify =
        addFlag(command, "--verify", options.verify,
                "read the file back and compare every value with the checkpoint before it appears under its name");
    addFlag(command, "--dry-run", options.dry_run, "read and describe the checkpoint, write no .gsc").excludes(verify);
}

} // namespace

void addConvertCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ConvertOptions>();
    CLI::App& command = addCommand(app, "convert", "Turn a trained model into one .gsc file");
    addText(command, "INPUT,-i,--input", options->input, "MODEL|FILE.ply",
            "model folder, point_cloud/iteration_N folder or PLY")
        .required();
    addBakeOptions(command, *options);
    addCheckpointOptions(command, options->checkpoint);
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "Reads Scaffold-GS, Octree-GS and Octree-AnyGS scaffold models, told apart by\n"
                       "content. A model that cannot be kept exactly is refused with exit code 5 or 3.\n"
                       "\n"
                       "examples:\n"
                       "  gsc convert output/city -o city.gsc\n"
                       "  gsc convert output/room -o room.gsc -w --appearance 10 --report room.json \\\n"
                       "      --progress plain");
    onParsed(command, invocation, options, runConvert);
}

} // namespace gsc
