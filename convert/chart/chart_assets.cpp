// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/chart_assets.h"

#include "convert/page/asset.h"

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
