// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cli/setting_words.h"
#include "player/commands/commands.h"
#include "player/commands/render_options.h"
#include "runtime/cli/options.h"
#include "player/window/window.h"
#include "player/xr/xr.h"
#include "player/commands/worker_flags.h"

#include <memory>

namespace gsc {

namespace {

constexpr const char* kXrExamples = R"(examples:
  gsc-play xr --info
      list OpenXR's runtime, the headset and its views, and tell whether the
      headset's GPU is the one that draws
  gsc-play xr city.gsc --keep-place --fallback window
      where the viewer was left is stored in city.gsc.place.json, and is where
      the next session starts
  gsc-play xr city.gsc --start table
      the city as a model on a table; a grip with both hands makes it larger
  gsc-play xr city.gsc --cameras flight.json --ride --target-ms 9 \
      --log log.jsonl
      carried along a path; levels fall while frames take longer

The left stick walks, the right one turns by 30 degrees and goes up and down. A
grip holds the world and pulls it; both turn and scale it. The trigger goes
where the hand points, the menu button back to the start.

Each refresh of the display shows the newest finished picture, which the headset
turns from the pose it was drawn for to where the eyes are now: no refresh waits
for the renderer.)";

struct XrChoice {
    XrOptions xr;
    bool info = false;
    std::string fallback = "none";
};

void addXrOptions(CLI::App& app, XrChoice& choice)
{
    XrOptions& options = choice.xr;
    const Heading heading(app, "Headset");
    addFlag(app, "--info", choice.info, "list OpenXR's loader and runtime and the headset, and end");
    addChoice<std::string>(app, "--fallback", choice.fallback, {{"none", "none"}, {"window", "window"}},
                           "default: none", "view to open if there is no headset, or when it goes away");
    addNumber(app, "--xr-scale", options.scale, {0.05, 4}, " times", "X (default: 1)",
              "factor of the picture width and height that the runtime recommends; larger is sharper and slower")
        .rare();
    addChoice<bool>(app, "--xr-space", options.stage, {{"local", false}, {"stage", true}}, "default: local",
                    "height of the start: local: the viewer's eyes when the session starts; stage: 1.6 m above the "
                    "floor of the room")
        .rare();
    addChoice<StartPlace>(
        app, "--start", options.start,
        {{"ground", StartPlace::Ground}, {"camera", StartPlace::Camera}, {"table", StartPlace::Table}},
        "default: what shows most of the model",
        "where the viewer starts: standing where the first camera looks; at the first camera, head level; or before "
        "the whole model, a metre wide");
    addNumber(app, "--metre", options.metre, {0, 1e12, true}, " world units", "UNITS (default: the model's)",
              "length of a metre of the viewer's body in world units; a larger one makes the model look smaller")
        .rare();
    addFlag(app, "--ride", options.rides, "move the viewer along the cameras, kept level, at --ride-fps");
    addNumber(app, "--ride-fps", options.ride_fps, {1e-3, 1e4}, " a second", "FPS (default: 72)",
              "cameras per second of --ride, by the clock of the headset; more is faster")
        .rare();
    addFlag(app, "--keep-place", options.keeps_place,
            "start where the viewer stood at the end of the last session, stored in FILE.place.json "
            "(schemas/place.schema.json)");
    addFlag(app, "--xr-depth", options.depth,
            "give the headset depths with the pictures, if its runtime takes them (XR_KHR_composition_layer_depth); "
            "slower: both then go through host memory")
        .rare();
    addFlag(app, "--xr-sync", options.waits,
            "wait in each frame for the picture of its own pose, for tests and recordings: the display then misses "
            "refreshes")
        .rare();
    addFlag(app, "--xr-late", options.late,
            "ask the headset for the eyes' pose again right before their picture is drawn, predicted for when it will "
            "be seen")
        .rare();
    addFirstPicture(app, options.play);
    addNumber(app, "--seconds", options.seconds, {0, 1e9}, " seconds", "S (default: 0)",
              "seconds after which the session ends; 0 = when the viewer leaves it in the headset");
    addText(app, "--log", options.log, "FILE", "file to write a JSON line per frame to (schemas/xr-log.schema.json)");
    addFlag(app, "-w,--overwrite", options.play.output.overwrite, "replace the log if it exists");
}

void checkXrOptions(const CLI::App& app, const XrChoice& choice)
{
    const XrOptions& options = choice.xr;
    if (choice.info) {
        for (const char* option :
             {"FILE", "--fallback", "--ride", "--ride-fps", "--keep-place", "--xr-sync", "--xr-late", "--seconds",
              "--log", "--overwrite", "--metre", "--cameras", "--target-ms", "--first-picture", "--start"})
            checkEffect(app, option, false, "no --info");
        return;
    }
    if (options.play.model.file.empty())
        throw Error(ErrorCode::Usage, "FILE", "not given", "a .gsc model", "pass one, or --info");
    checkRenderOptions(app, options.play, false);
    checkWorkerOptions(app, options.play);
    checkEffect(app, "--overwrite", !options.log.empty(), "--log");
    checkEffect(app, "--ride-fps", options.rides, "--ride");
    for (const char* option : {"--keep-place", "--start"})
        if (options.rides)
            checkEffect(app, option, false, "a viewer who moves by hand, without --ride");
}

ErrorCode tellHeadset(const XrOptions& options, Reporter& report)
{
    HeadsetFacts known;
    try {
        const HeadsetFacts facts = headsetFacts(options, known, report);
        if (report.json()) {
            OrderedJson json = {{"schema", "gsc.xr-info/1"}};
            json.update(headsetJson(facts));
            report.object(json);
        } else {
            report.text(headsetText(facts));
        }
        return ErrorCode::Ok;
    } catch (const Error& e) {
        if (!report.json())
            report.text(headsetText(known, e));
        throw;
    }
}

ErrorCode runXrCommand(const XrChoice& choice, Reporter& report)
{
    if (choice.info)
        return tellHeadset(choice.xr, report);
    try {
        const XrSummary summary = runXr(choice.xr, report);
        if (report.json())
            report.object(xrJson(summary));
        else
            report.text(xrText(summary));
        return ErrorCode::Ok;
    } catch (const HeadsetError& e) {
        if (choice.fallback != "window")
            throw;
        report.warning(warningText(e) + "; a window is opened instead, without the options of a headset");
    }
    WindowOptions window;
    window.play.model = choice.xr.play.model;
    window.play.cameras = choice.xr.play.cameras;
    window.play.frame = choice.xr.play.frame;
    window.play.devices = choice.xr.play.devices;
    window.seconds = choice.xr.seconds;
    const WindowSummary summary = runWindow(window, report);
    if (report.json())
        report.object(windowJson(summary));
    else
        report.text(windowText(summary));
    return ErrorCode::Ok;
}

} // namespace

void addXrCommand(CLI::App& root, Invocation& invocation)
{
    auto choice = std::make_shared<XrChoice>();
    choice->xr.play.view.eyes = 2;
    CLI::App& command = addCommand(root, "xr", "Walk through a model in a headset");
    addFile(command, choice->xr.play);
    addXrOptions(command, *choice);
    addCameras(command, choice->xr.play);
    addFrames(command, choice->xr.play);
    addLookOptions(command, choice->xr.play);
    addRunOptions(command, choice->xr.play, Views::Headset);
    addTargetOption(command, choice->xr.play, Views::Headset);
    addWorkerOptions(command, choice->xr.play);
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, kXrExamples);
    onParsed(command, [&command, &invocation, choice] {
        checkXrOptions(command, *choice);
        settleFirstPicture(choice->xr.play);
        invocation.run = [choice](Reporter& report) { return runXrCommand(*choice, report); };
    });
}

} // namespace gsc
