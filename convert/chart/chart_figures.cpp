// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_figures.h"

#include "convert/chart/chart_assets.h"
#include "convert/chart/chart_page.h"
#include "convert/chart/script_engine.h"
#include "convert/chart/svg_png.h"
#include <gsc/interrupt.h>
#include "runtime/module/load_module.h"

namespace gsc {

using Json = nlohmann::ordered_json;

bool hasFigures()
{
    return true;
}

void requireFigures() {}

std::vector<FigureFile> drawFigures(const Json& model, const std::function<void(size_t done, size_t total)>& progress)
{
    const auto& rasteriser = loadModule<SvgPngFunctions>("gsc_figures_rsvg", kSvgPngThreads);
    ScriptEngine engine;
    engine.run(stillScript(), "still.js"); // first: it defines the browser's functions that ECharts calls
    engine.run(echartsScript(), "ECharts");
    engine.run(partsScript(), "parts.js");
    engine.run(figuresScriptOf(kindOf(model)), "figures");
    engine.call("gscLoad", model.dump());
    const Json kinds = Json::parse(engine.call("gscKinds", ""));
    std::vector<FigureFile> files;
    const size_t total = model["panels"].size() * kinds.size();
    for (size_t panel = 0; panel < model["panels"].size(); ++panel) {
        for (const Json& kind : kinds) {
            throwIfInterrupted();
            const std::string name =
                model["panels"][panel]["file_name"].get<std::string>() + "-" + kind["id"].get<std::string>();
            std::string svg =
                engine.call("gscDraw", Json{{"panel", panel}, {"kind", kind["id"]}, {"title", kind["title"]}}.dump());
            files.push_back({name + ".png", rasteriser.draw(svg, name)});
            files.push_back({name + ".svg", std::move(svg)});
            progress(files.size() / 2, total);
        }
    }
    return files;
}

} // namespace gsc
