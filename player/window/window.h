// SPDX-License-Identifier: Apache-2.0
// gsc-play window: a model in a window, flown through by hand.
#pragma once

#include "player/options/play_options.h"
#include "runtime/cli/json.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/service_trace.h"

#include <string>
#include <vector>

namespace gsc {

struct WindowOptions {
    PlayOptions play;         // width, height: of the window, 0 = 1280 x 720; its outputs are not used
    std::string folder = "."; // takes screenshots and recorded paths
    std::string log;          // file of JSON lines, empty = none; OutputChoice::overwrite applies to it
    bool tears = false;       // does not wait for the display's refresh: pictures come sooner, but may tear
};

struct WindowSummary {
    std::string file;
    double seconds = 0;                // time that the window was open
    uint64_t frames = 0, pictures = 0; // frames that the window showed; pictures drawn for it
    ServiceStats service;
    std::vector<std::string> files; // files that were written
};

// Returns when the window is closed. Throws Error: Unsupported without a display, Vulkan 1.2 or a build that has windows;
// Device where display or every device that draws is lost; others as the renderer has them.
WindowSummary runWindow(const WindowOptions& options, Reporter& log);

OrderedJson windowJson(const WindowSummary& summary); // schemas/window-report.schema.json
std::string windowText(const WindowSummary& summary); // a line or some

} // namespace gsc
