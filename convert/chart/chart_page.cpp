// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_page.h"

#include "convert/chart/chart_assets.h"
#include "convert/page/page_text.h"

#include <string_view>
#include <utility>
#include <vector>

namespace gsc {

namespace {

// Explanations of the words on a page, in HTML.
constexpr std::string_view kServiceNotes =
    "<b>Latency</b>: of a pose, from being submitted to being shown. <b>Late</b>: drawn when a newer "
    "picture was shown already. <b>Expired</b>: never begun, because a newer pose was there or it had "
    "waited for too long. <b>Frames</b>: poses whose longest part the worker drew; <b>parts</b>: all that "
    "it drew. <b>Busy</b>: of the whole run. <b>Stages</b>: of those frames; in modes eye and split the "
    "other parts of a pose are not told by stage, and neither is what is between stages.";
constexpr std::string_view kCurveNotes =
    "<b>Together</b>: PSNR of all poses of the verdict, from their mean square error, against pictures of "
    "the whole model; no bake looked from them before. <b>Worst</b>: of the worst of them. <b>An "
    "anchor</b>: bytes of the archive by anchors of the whole model. <b>Resident</b>: model and buffers "
    "of the renderer. <b>Frame</b> and <b>decode</b>: medians over those poses, of each the least of four draws, tier "
    "exact.";

} // namespace

PageKind kindOf(const nlohmann::ordered_json& model)
{
    const std::string kind = model.value("kind", "");
    return kind == "service" ? PageKind::Service : kind == "curve" ? PageKind::Curve : PageKind::Runs;
}

std::string_view figuresScriptOf(PageKind kind)
{
    return kind == PageKind::Service ? serviceFiguresScript()
           : kind == PageKind::Curve ? curveFiguresScript()
                                     : figuresScript();
}

std::string chartPage(const nlohmann::ordered_json& model)
{
    const std::string json = scriptJson(model);
    const PageKind kind = kindOf(model);
    const bool runs = kind == PageKind::Runs, service = kind == PageKind::Service;
    const std::string_view title = service ? "Renderer service" : "Bytes against quality and time";
    std::vector<std::pair<std::string_view, std::string_view>> parts;
    if (!runs)
        parts.push_back({"@TITLE@", title});
    parts.push_back({"@STYLE@", pageStyle()});
    if (!runs) {
        parts.push_back({"@TITLE@", title});
        parts.push_back({"@NOTES@", service ? kServiceNotes : kCurveNotes});
    }
    parts.push_back({"@MODEL@", json});
    parts.push_back({"@ECHARTS@", echartsScript()});
    parts.push_back({"@PARTS@", partsScript()});
    parts.push_back({"@FIGURES@", figuresScriptOf(kind)});
    parts.push_back({"@REPORT@", runs ? reportScript() : plainReportScript()});
    return filledPage(runs ? pageTemplate() : plainPageTemplate(), parts);
}

} // namespace gsc
