// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "player/commands/commands.h"
#include "player/commands/render_options.h"
#include "player/present/presenter.h"
#include "runtime/cli/options.h"
#include "player/window/window.h"
#include "player/commands/worker_flags.h"

#include <filesystem>
#include <memory>

namespace gsc {

namespace {

constexpr const char* kWindowExamples = R"(examples:
  gsc-play window city.gsc
      fly with W A S D and the left mouse button; F1 lists every key, Tab opens
      the panel
  gsc-play window city.gsc --gpus all --min-fps 60 --tier exact
      several GPUs; one joins before the rate falls below 60
  gsc-play window city.gsc --cameras path.json --folder pictures
      fly along a path with Space; screenshots (F12) and recorded paths (R) go
      to pictures

The window shows the newest finished picture and never waits for the next. A
recorded path is a trajectory, which --cameras of every command takes:
gsc-play bench city.gsc --cameras path-0001.json.)";

void addWindowOptions(CLI::App& app, WindowOptions& options)
{
    const Heading heading(app, "Window");
    addText(app, "--folder", options.folder, "DIR (default: .)",
            "folder for screenshots and recorded paths; it is made if it is missing");
    addText(app, "--log", options.log, "FILE",
            "file to write a JSON line per shown frame to (schemas/window-log.schema.json)");
    addFlag(app, "-w,--overwrite", options.play.output.overwrite, "replace the log if it exists");
    addFirstPicture(app, options.play);
    addFlag(app, "--no-vsync", options.tears,
            "do not wait for the display between two frames; faster, but pictures may tear")
        .rare();
}

void checkWindowOptions(const CLI::App& app, const WindowOptions& options)
{
    checkRenderOptions(app, options.play, false, true); // true: the person may switch to two eyes in the window
    checkWorkerOptions(app, options.play);
    checkEffect(app, "--overwrite", !options.log.empty(), "--log");
    if (std::filesystem::exists(options.folder) && !std::filesystem::is_directory(options.folder))
        throw Error(ErrorCode::Io, options.folder, "is no folder", "one for screenshots and paths",
                    "pass another with --folder");
}

} // namespace

ErrorCode runWindowCommand(const WindowOptions& options, Reporter& report)
{
    const WindowSummary summary = runWindow(options, report);
    if (report.json())
        report.object(windowJson(summary));
    else
        report.text(windowText(summary));
    return ErrorCode::Ok;
}

void addWindowCommand(CLI::App& root, Invocation& invocation)
{
    auto options = std::make_shared<WindowOptions>();
    CLI::App& command = addCommand(root, "window", "Fly through a model in a window");
    addFile(command, options->play);
    optionOf(command, "FILE").required();
    addWindowOptions(command, *options);
    addCameras(command, options->play);
    addFrames(command, options->play);
    addViewOptions(command, options->play, formatString("%ux%u", kWindowWidth, kWindowHeight));
    addRunOptions(command, options->play, Views::Window);
    addTargetOption(command, options->play, Views::Window);
    addWorkerOptions(command, options->play);
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, kWindowExamples);
    onParsed(command, [&command, &invocation, options] {
        checkWindowOptions(command, *options);
        settleFirstPicture(options->play);
        invocation.run = [options](Reporter& report) { return runWindowCommand(*options, report); };
    });
}

} // namespace gsc
