// SPDX-License-Identifier: Apache-2.0
// Draws the figures of figures.js as SVG outside a browser; called by chart_figures.cpp.

// what ECharts expects of a browser and does not need for pictures that stand still
var setTimeout = function () { return 0; }, clearTimeout = function () {};

var gscModel = null;
function gscLoad(text) { gscModel = JSON.parse(text); return String(gscModel.panels.length); }
function gscKinds() { return JSON.stringify(gscFigures.kinds); }
function gscDraw(text) {
  var wanted = JSON.parse(text), panel = gscModel.panels[wanted.panel];
  var built = gscFigures.build(panel, wanted.kind, {
    dark: false, view: 'min', width: 1000, shown: panel.views.min.shown,
    title: panel.title + ': ' + wanted.title.charAt(0).toLowerCase() + wanted.title.slice(1), subtitle: panel.words
  });
  var chart = echarts.init(null, null, {renderer: 'svg', ssr: true, width: 1000, height: built.height});
  chart.setOption(built.option);
  // librsvg and others do not know dominant-baseline
  var shift = {central: '0.35em', 'text-before-edge': '0.8em', 'text-after-edge': '-0.2em'};
  var svg = chart.renderToSVGString().replace(/dominant-baseline="([a-z-]+)"/g, function (all, kind) {
    return shift[kind] ? 'dy="' + shift[kind] + '"' : all;
  });
  chart.dispose();
  return svg;
}
