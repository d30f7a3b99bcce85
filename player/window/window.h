// SPDX-License-Identifier: Apache-2.0
// gsc-play window: shows a model in a window in which a person moves through it.
#pragma once

#include "player/options/play_options.h"
#include "runtime/cli/json.h"
#include "runtime/cli/reporter.h"
#include "runtime/service/service_trace.h"

#include <string>
#include <vector>

namespace gsc {

struct WindowOptions {
    PlayOptions play;         // width, height: the window's, 0 = 1280 x 720; the outputs are not used
    std::string folder = "."; // takes screenshots and recorded paths
    std::string log;          // path of a log of JSON lines, empty = none; OutputChoice::overwrite applies to it
    bool tears = false;       // pictures are shown without waiting for the display's refresh: sooner, but they may tear
    double seconds = 0;       // time after which the window closes, seconds; 0 = a person closes it
};

struct WindowSummary {
    std::string file;
    double seconds = 0;                // time that the window was open, seconds
    uint64_t frames = 0, pictures = 0; // frames that the window showed; pictures that were drawn for them
    ServiceStats service;
    std::vector<std::string> files; // paths of screenshots and recordings
};

bool hasWindow(); // returns true if this build has one

// Opens the window and returns when it is closed. Throws Error: Unsupported if there is no display or no Vulkan 1.2,
// or the build has no windows; Device if the display or every device that draws is lost; others as the renderer throws
// them.
WindowSummary runWindow(const WindowOptions& options, Reporter& log);

// returns the report as JSON; schemas/window-report.schema.json describes it
OrderedJson windowJson(const WindowSummary& summary);
std::string windowText(const WindowSummary& summary); // returns the report as a few lines of text

} // namespace gsc
