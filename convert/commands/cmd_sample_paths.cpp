// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/commands/parse_size.h"
#include "convert/sample/make_paths.h"
#include "format/interrupt.h"
#include "format/output_paths.h"

#include <CLI/CLI.hpp>

#include <memory>

namespace gsc {

namespace {

struct RawPaths {
    std::string size;
    double fov = 90; // degrees
};

void finishOptions(const RawPaths& raw, PathsOptions& options)
{
    if (!raw.size.empty()) {
        const auto size = parseImageSize(raw.size);
        if (!size)
            throw Error(ErrorCode::Usage, formatString("--size %.40s: no size, expected width x height such as "
                                                       "2048x2048, each 1 to 32768",
                                                       raw.size.c_str()));
        options.width = size->width;
        options.height = size->height;
    }
    if (!(raw.fov >= 1 && raw.fov <= 170))
        throw Error(ErrorCode::Usage, formatString("--fov %g: expected 1 to 170 degrees", raw.fov));
    if (!(options.fps >= 1 && options.fps <= 1000))
        throw Error(ErrorCode::Usage, formatString("--fps %g: expected 1 to 1000 frames per second", options.fps));
    if (!(options.ipd >= 0 && options.ipd < 1e9))
        throw Error(ErrorCode::Usage, formatString("--ipd %g: expected a length above 0 in world units", options.ipd));
    options.fov_x = degrees(raw.fov);
}

ErrorCode runPaths(const RawPaths& raw, PathsOptions options, Reporter& report)
{
    installInterruptHandler();
    finishOptions(raw, options);
    std::vector<NamedPath> outputs;
    for (const std::string& name : modelPathNames())
        outputs.push_back({options.output + "/" + name + ".json", "--output"});
    checkOutputsDiffer(outputs, std::vector<NamedPath>{{options.input, "the model"}});
    const PathsReport made = makePaths(options);
    if (made.capture == CaptureKind::None)
        report.warning(options.input +
                       ": holds no cameras that see its anchors; the paths follow its bounds, and up is "
                       "guessed");
    if (report.json()) {
        Json paths = Json::array();
        for (const ModelPath& path : made.paths)
            paths.push_back({{"name", path.path.name},
                             {"file", options.output + "/" + path.path.name + ".json"},
                             {"description", path.path.description},
                             {"frames", path.path.frames.size()},
                             {"least_share", jsonNumber(path.least_share)},
                             {"top_speed", jsonNumber(path.top_speed)}});
        report.object({{"schema", "gsc.paths/1"},
                       {"generator", {{"name", "gsc"}, {"version", GSC_VERSION}}},
                       {"input", options.input},
                       {"output", options.output},
                       {"capture", captureName(made.capture)},
                       {"cameras", made.cameras},
                       {"metre", jsonNumber(made.metre)},
                       {"metre_rule", made.metre_rule},
                       {"paths", paths}});
    } else {
        std::string text =
            formatString("wrote       %zu paths into %s\ncapture     %s, %zu cameras\n", made.paths.size(),
                         options.output.c_str(), captureName(made.capture), made.cameras);
        text += formatString("metre       %.4g world units (%s)\n", made.metre, made.metre_rule.c_str());
        for (const ModelPath& path : made.paths)
            text +=
                formatString("%-12s%4zu frames, at least %.0f %% of the anchors in sight, up to %.3g m/s\n",
                             path.path.name.c_str(), path.path.frames.size(), 100 * path.least_share, path.top_speed);
        report.text(text);
    }
    report.done("made " + options.output);
    return ErrorCode::Ok;
}

} // namespace

void addSamplePathsCommand(CLI::App& sample, Invocation& invocation)
{
    auto options = std::make_shared<PathsOptions>();
    auto raw = std::make_shared<RawPaths>();
    CLI::App* command = sample.add_subcommand("paths", "Make camera paths for a .gsc file, at the pace of a viewer");
    command->add_option("FILE", options->input, "the model, a .gsc")->required()->option_text(" ");
    command->add_option("-o,--output", options->output, "folder for the NAME.json")->required()->option_text("DIR");
    command->add_flag("-w,--overwrite", options->overwrite, "replace paths that exist");
    command->add_option("--size", raw->size, "pixels of the image (default: 2048x2048)")->option_text("WxH");
    command->add_option("--fov", raw->fov, "horizontal angle of view (default: 90)")->option_text("DEGREES");
    command->add_option("--fps", options->fps, "frames per second (default: 72)")->option_text("N");
    command
        ->add_option("--ipd", options->ipd,
                     "distance of the eyes in world units, 0.064 m; paces follow from it (default: the file's metre)")
        ->option_text("LENGTH");
    command->add_option("--only", options->only, "names of the paths wanted (default: all)")
        ->delimiter(',')
        ->option_text("NAME,...");
    addReporterOptions(*command, invocation.reporter, true);
    command->footer("example:\n  gsc sample paths room.gsc -o room_paths --size 1920x1080 --only walk,orbit");
    command->callback([options, raw, &invocation] {
        invocation.run = [options, raw](Reporter& report) { return runPaths(*raw, *options, report); };
    });
}

} // namespace gsc
