// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/sample/paths/make_paths.h"
#include "convert/sample/paths/model_paths.h"
#include <gsc/file/output_paths.h>
#include "runtime/cli/options.h"
#include "runtime/cli/version.h"

#include <memory>

namespace gsc {

namespace {

struct RawPaths {
    double fov = 90; // horizontal angle of view in degrees
    std::vector<std::string> only;
};

void finishOptions(const RawPaths& raw, PathsOptions& options)
{
    for (const std::string& list : raw.only) // each may itself be a list, such as "walk,orbit"
        for (size_t at = 0; at <= list.size();) {
            const size_t end = std::min(list.find(',', at), list.size());
            options.only.push_back(list.substr(at, end - at));
            at = end + 1;
        }
    options.fov_x = degrees(raw.fov);
}

ErrorCode runPaths(const RawPaths& raw, PathsOptions options, Reporter& report)
{
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
                       {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
                       {"input", options.input},
                       {"output", options.output},
                       {"capture", captureName(made.capture)},
                       {"cameras", made.cameras},
                       {"metre", jsonNumber(made.metre)},
                       {"metre_rule", made.metre_rule},
                       {"paths", paths}});
    } else {
        std::string text = formatString("wrote       %s into %s\ncapture     %s, %s\n",
                                        formatCount(made.paths.size(), "path").c_str(), options.output.c_str(),
                                        captureName(made.capture), formatCount(made.cameras, "camera").c_str());
        text += formatString("metre       %.4g world units (%s)\n", made.metre, made.metre_rule.c_str());
        for (const ModelPath& path : made.paths)
            text += formatString("%-12s%12s, at least %.0f %% of the anchors in sight, up to %.3g m/s\n",
                                 path.path.name.c_str(), formatCount(path.path.frames.size(), "frame").c_str(),
                                 100 * path.least_share, path.top_speed);
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
    CLI::App& command = addCommand(sample, "paths", "Make camera paths for a .gsc file, at the pace of a viewer");
    addText(command, "FILE", options->input, "FILE.gsc", "model to make paths for").required();
    addText(command, "-o,--output", options->output, "DIR", "folder to write a NAME.json for each path to").required();
    addFlag(command, "-w,--overwrite", options->overwrite, "replace paths that exist");
    addImageSize(command, "--size", options->width, options->height, "WxH (default: 2048x2048)",
                 "width and height of a picture in pixels");
    addNumber(command, "--fov", raw->fov, {1, 170}, " degrees", "DEGREES (default: 90)", "horizontal angle of view");
    addNumber(command, "--fps", options->fps, {1, 1000}, "", "N (default: 72; flight, stroll, look_around: 90)",
              "frames per second");
    detail::addValue(command, "--ipd", "LENGTH (default: 64mm)",
                     "distance between the eyes: in metres, such as 64mm, or in world units, which then count as 64mm: "
                     "so they set the length of the model's metre, and with it the speed of the paths",
                     [options](const std::string& name, const std::string& text) {
                         options->ipd = parseLength(text, name.c_str());
                     });
    std::string names;
    for (const std::string& name : modelPathNames())
        names += (names.empty() ? "" : "|") + name;
    addTexts(command, "--only", raw->only, names + " (default: all)", "names of the paths wanted, such as walk,orbit");
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "example:\n  gsc sample paths room.gsc -o room_paths --size 1920x1080 --only walk,orbit");
    onParsed(command, [options, raw, &invocation] {
        invocation.run = [options, raw](Reporter& report) { return runPaths(*raw, *options, report); };
    });
}

} // namespace gsc
