// SPDX-License-Identifier: Apache-2.0
#include "player/window/window.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "runtime/module/load_module.h"
#include "runtime/cli/json_lines.h"
#include "runtime/cli/version.h"
#include "player/window/window_session.h"
#include "player/devices/open_renderer.h"
#include "player/frames/lod_target.h"
#include "player/devices/worker_options.h"
#include "player/devices/worker_report.h"

#include <algorithm>

namespace gsc {

namespace {

const PresentFunctions& presentFunctions()
{
#ifdef GSC_WITH_WINDOW
    return loadModule<PresentFunctions>("gsc_present");
#else
    throw Error(ErrorCode::Unsupported, "window", "this build has none", "one made with Vulkan, GLFW and Dear ImGui",
                "run .ci/setup.sh window and build again, or write pictures (gsc-play FILE --out FOLDER)");
#endif
}

std::string titleOf(const WindowOptions& options)
{
    return options.play.model.file + " - gsc";
}

// Sets what the options leave open of the window's size.
void settleSize(ViewChoice& view)
{
    if (view.width == 0)
        view.width = view.height > 0 ? std::max(view.height * kWindowWidth / kWindowHeight, 1u) : kWindowWidth;
    if (view.height == 0)
        view.height = std::max(view.width * kWindowHeight / kWindowWidth, 1u);
}

// Ctrl-C ends a window as closing it does.
void runSession(WindowSession& session)
{
    try {
        while (session.step() && !interrupted()) {
        }
    } catch (const std::exception&) {
        session.keepRecording();
        throw;
    }
}

} // namespace

bool hasWindow()
{
#ifdef GSC_WITH_WINDOW
    return true;
#else
    return false;
#endif
}

WindowSummary runWindow(const WindowOptions& options, Reporter& log)
{
    checkJsonLines(options.log, options.play.output.overwrite, options.play.model.file, options.play.cameras.file);
    WindowModel model{options, openScene(options.play.model, options.play.devices, log)};
    ViewChoice& view = model.options.play.view;
    settleSize(view);
    PresenterOptions presenter;
    presenter.title = titleOf(options);
    presenter.width = view.width;
    presenter.height = view.height;
    presenter.waits_for_display = !options.tears;
    presenter.device = deviceUuid(firstDevice(options.play.devices));
    const std::unique_ptr<Presenter> display = presentFunctions().open(presenter);
    checkLevelOptions(*model.scene, options.play.model.file, options.play.frame);
    WindowHistory history;
    while (true) {
        WindowSession session(model, *display, std::move(history), log);
        runSession(session);
        history = session.finish();
        if (!session.next() || interrupted())
            return history.summary;
        model = *session.next();
        display->setTitle(titleOf(model.options));
    }
}

OrderedJson windowJson(const WindowSummary& summary)
{
    const LedgerCounts& poses = summary.service.counts;
    return {
        {"schema", "gsc.window/1"},
        {"tool", {{"name", "gsc-play"}, {"version", toolVersion()}}},
        {"file", summary.file},
        {"seconds", summary.seconds},
        {"frames", summary.frames},
        {"pictures", summary.pictures},
        {"poses",
         {{"submitted", poses.submitted},
          {"shown", poses.of(PoseEnd::Shown)},
          {"late", poses.of(PoseEnd::Late)},
          {"expired", poses.of(PoseEnd::Expired)},
          {"failed", poses.of(PoseEnd::Failed)}}},
        {"workers", workersJson(summary.service)},
        {"written", summary.files},
    };
}

std::string windowText(const WindowSummary& summary)
{
    const LedgerCounts& poses = summary.service.counts;
    const auto of = [&](PoseEnd end) { return formatCount(poses.of(end)); };
    std::string text = formatString(
        "%s in %.1f s; %s: %s shown, %s late, %s expired, %s failed\n", formatCount(summary.frames, "frame").c_str(),
        summary.seconds, formatCount(poses.submitted, "pose").c_str(), of(PoseEnd::Shown).c_str(),
        of(PoseEnd::Late).c_str(), of(PoseEnd::Expired).c_str(), of(PoseEnd::Failed).c_str());
    text += workersText(serviceFacts(summary.service));
    for (const std::string& file : summary.files)
        text += "wrote " + file + "\n";
    return text;
}

} // namespace gsc
