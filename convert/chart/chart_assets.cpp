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
    extern "C" __attribute__((visibility("hidden"))) const char gsc_asset_##name##_end[];                              \
    std::string_view gsc::name()                                                                                       \
    {                                                                                                                  \
        return {gsc_asset_##name, gsc_asset_##name##_end};                                                             \
    }                                                                                                                  \
    static_assert(true)

GSC_ASSET(pageTemplate, "page/page.html");
GSC_ASSET(pageStyle, "page/page.css");
GSC_ASSET(partsScript, "page/parts.js");
GSC_ASSET(figuresScript, "page/figures.js");
GSC_ASSET(reportScript, "page/report.js");
GSC_ASSET(plainPageTemplate, "page/plain_page.html");
GSC_ASSET(serviceFiguresScript, "page/service_figures.js");
GSC_ASSET(curveFiguresScript, "page/curve_figures.js");
GSC_ASSET(plainReportScript, "page/plain_report.js");
GSC_ASSET(stillScript, "page/still.js");
GSC_ASSET(echartsScript, "echarts/echarts.common.min.js");
