// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_assets.h"

// The assembler copies the file as it is: no generated source, no limit on the length of a literal.
#define GSC_ASSET(name, file)                                                                                          \
    __asm__(".pushsection .rodata\n"                                                                                   \
            ".global gsc_asset_" #name "\n.hidden gsc_asset_" #name "\n"                                               \
            ".global gsc_asset_" #name "_end\n.hidden gsc_asset_" #name "_end\n"                                       \
            "gsc_asset_" #name ":\n.incbin \"" GSC_CHART_FOLDER "/" file "\"\n"                                        \
            "gsc_asset_" #name "_end:\n.byte 0\n"                                                                      \
            ".popsection\n");                                                                                          \
    extern "C" __attribute__((visibility("hidden"))) const char gsc_asset_##name[];                                    \
    extern "C" __attribute__((visibility("hidden"))) const char gsc_asset_##name##_end[]

GSC_ASSET(page, "page/page.html");
GSC_ASSET(style, "page/page.css");
GSC_ASSET(parts, "page/parts.js");
GSC_ASSET(figures, "page/figures.js");
GSC_ASSET(report, "page/report.js");
GSC_ASSET(still, "page/still.js");
GSC_ASSET(echarts, "echarts/echarts.common.min.js");

namespace gsc {

std::string_view pageTemplate()
{
    return {gsc_asset_page, gsc_asset_page_end};
}

std::string_view pageStyle()
{
    return {gsc_asset_style, gsc_asset_style_end};
}

std::string_view partsScript()
{
    return {gsc_asset_parts, gsc_asset_parts_end};
}

std::string_view figuresScript()
{
    return {gsc_asset_figures, gsc_asset_figures_end};
}

std::string_view reportScript()
{
    return {gsc_asset_report, gsc_asset_report_end};
}

std::string_view stillScript()
{
    return {gsc_asset_still, gsc_asset_still_end};
}

std::string_view echartsScript()
{
    return {gsc_asset_echarts, gsc_asset_echarts_end};
}

} // namespace gsc
